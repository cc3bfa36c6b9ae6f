"""The bare name of a shipped model or texture space, such as granite-grey."""

from pathlib import Path


def is_bare_name(path: Path) -> bool:
    """Whether it has no folder and no ending and is no file, so that it is looked for by name."""
    return path.name == str(path) and not path.suffix and not path.is_file()
