"""Reports of a graded class: files for people, for learning platforms and for CI."""
