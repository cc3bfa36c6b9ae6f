"""The shipped descriptor network and its weights."""
