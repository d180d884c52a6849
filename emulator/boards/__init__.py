"""Boards as data without behaviour: their components and supplied firmware."""
