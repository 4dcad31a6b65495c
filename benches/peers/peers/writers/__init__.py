"""A scene in the language of each renderer."""
