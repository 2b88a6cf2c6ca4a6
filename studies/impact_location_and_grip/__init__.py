"""Where the ball hits and how tight the grip is: a backhand at nine points, three grips."""
