"""Hooks of MkDocs: links to sources, which are no part of the site, become text, and links of
notebooks lead to pages of the site.

The page of the shipped models, which `solidtex-view` writes, becomes a part of the site.
"""

import re
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files, InclusionLevel

from solidtex_export.export.file_format import model_file
from solidtex_export.export.view.page import Material, package_folder
from solidtex_export.export.view.page import page as view_page

MATERIALS = "materials.html"


def on_files(files: Files, config: Any, **_: Any) -> Files:
    paths = sorted(Path(config.docs_dir).parent.glob("models/*.solidtex"))
    text = view_page([Material(model_file.read(path)) for path in paths], package_folder())
    included = InclusionLevel.INCLUDED
    files.append(File.generated(config, MATERIALS, content=text, inclusion=included))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, **_: Any) -> str:
    docs = Path(config.docs_dir).resolve()
    here = Path(page.file.abs_src_path).parent

    def replaced(link: re.Match[str]) -> str:
        text, target = link[1], link[2]
        file = (here / target.partition("#")[0]).resolve()
        is_in_site = docs in file.parents and file.is_file() and file.suffix != ".html"
        if is_in_site or target == MATERIALS or re.match(r"[a-z]+:|#", target):
            return link[0]
        path = file.relative_to(docs.parent)
        named = text.strip("`") == str(path) or text.strip("`") == file.name
        return f"`{path}`" if named else f"{text} (`{path}`)"

    if page.file.src_uri == "gallery.md":
        markdown = markdown.replace(f"`{MATERIALS}`", f"[`{MATERIALS}`]({MATERIALS})")
    return re.sub(r"(?<!!)\[([^]]*)\]\(([^)\s]+)\)", replaced, markdown)


def on_page_content(html: str, page: Any, **_: Any) -> str:
    if not page.file.src_uri.endswith(".ipynb"):
        return html
    html = re.sub(r'href="([^":]*)README\.md', r'href="\1index.html', html)
    return re.sub(r'href="([^":]*)\.md', r'href="\1.html', html)
