"""What every fit is made of: the problem, the search, the result, its uncertainty."""
