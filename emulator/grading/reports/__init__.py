"""Reports of a class that has been graded: files for people, for learning platforms and for CI."""
