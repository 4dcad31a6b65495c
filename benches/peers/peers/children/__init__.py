"""Programs that are run as children: one render, or one conversion, each. They import nothing of their parents that is large."""
