"""A laboratory without a laboratory: data files with known truth, in the form of your own."""
