"""Gather the documents, with the pages that their links lead to, and build the site; a broken link fails it.

python scripts/docs_site.py out/site
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGES = ("*.md", "docs/*.md", "docs/tutorials/*.md", "benchmarks/*.md", "tracking/policies/README.md")
BESIDE = ("docs/pictures/*.png", "docs/pictures/*.webp", "docs/*.html")


def main(out: Path) -> int:
    """Copy what is read, turn links to code into names of files, build strictly."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "pages"
        files = [file for pattern in (*PAGES, *BESIDE) for file in sorted(ROOT.glob(pattern))]
        pages = {file.relative_to(ROOT) for file in files}
        for page in pages:
            target = source / page
            target.parent.mkdir(parents=True, exist_ok=True)
            if page.suffix == ".md":
                target.write_text(_links((ROOT / page).read_text(encoding="utf-8"), page, pages), encoding="utf-8")
            else:
                shutil.copyfile(ROOT / page, target)
        config = Path(folder) / "mkdocs.yml"
        told = (ROOT / "docs/site/mkdocs.yml").read_text(encoding="utf-8").replace('["../.."]', f'["{ROOT}"]')
        config.write_text(f"docs_dir: {source}\nsite_dir: {out.resolve()}\n{told}", encoding="utf-8")
        words = [sys.executable, "-m", "mkdocs", "build", "--strict", "-f", str(config)]
        return subprocess.run(words, check=False).returncode


def _links(text: str, page: Path, pages: set[Path]) -> str:
    """A page whose links to files that are no pages, as source code, are their names; a link to nothing stays, and fails."""

    def link(found: re.Match[str]) -> str:
        label, target = found[1], found[2]
        path = (ROOT / page.parent / target.partition("#")[0]).resolve()
        if "://" in target or not path.exists() or not path.is_relative_to(ROOT) or path.relative_to(ROOT) in pages:
            return found[0]
        return f"{label} (`{path.relative_to(ROOT)}`)"

    return re.sub(r"(?<!!)\[([^\]]+)\]\(([^)\s]+)\)", link, text)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "out" / "site")))
