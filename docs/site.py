"""Hook of MkDocs: links to sources, which are no part of the site, become text."""

import re
from pathlib import Path
from typing import Any


def on_page_markdown(markdown: str, page: Any, config: Any, **_: Any) -> str:
    docs = Path(config.docs_dir).resolve()
    here = Path(page.file.abs_src_path).parent

    def replaced(link: re.Match[str]) -> str:
        text, target = link[1], link[2]
        file = (here / target.partition("#")[0]).resolve()
        is_in_site = docs in file.parents and file.is_file() and file.suffix != ".html"
        if is_in_site or re.match(r"[a-z]+:|#", target):
            return link[0]
        path = file.relative_to(docs.parent)
        named = text.strip("`") == str(path) or text.strip("`") == file.name
        return f"`{path}`" if named else f"{text} (`{path}`)"

    return re.sub(r"(?<!!)\[([^]]*)\]\(([^)\s]+)\)", replaced, markdown)
