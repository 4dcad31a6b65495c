"""Steradian beside other renderers: the same scenes, one session, figures as ratios."""
