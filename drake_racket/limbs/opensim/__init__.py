"""The importer brings the skeleton of an OpenSim model into a Drake plant, exactly where it can."""
