"""Every fit is made of what is here: the problem, the search, the result, its uncertainty."""
