"""The site: links to code become names, links to pages stay, and one that leads nowhere fails the build."""

import importlib.util
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import ROOT

spec = importlib.util.spec_from_file_location("docs_site", ROOT / "scripts" / "docs_site.py")
site = importlib.util.module_from_spec(spec)
spec.loader.exec_module(site)


@pytest.mark.parametrize(
    ("text", "out"),
    [
        ("[the line](retarget/pipeline.py)", "the line (`retarget/pipeline.py`)"),
        ("[how](docs/faq.md)", "[how](docs/faq.md)"),
        ("[there](https://example.org/x.py)", "[there](https://example.org/x.py)"),
        ("[nowhere](docs/none.md)", "[nowhere](docs/none.md)"),
        ("![picture](docs/pictures/dance.webp)", "![picture](docs/pictures/dance.webp)"),
    ],
)
def test_links_to_code_become_names(text, out):
    assert site._links(text, Path("README.md"), {Path("README.md"), Path("docs/faq.md")}) == out


@pytest.mark.slow
@pytest.mark.parametrize("good", [True, False])
def test_a_link_that_leads_nowhere_fails_the_site(tmp_path, good):
    pytest.importorskip("mkdocs")
    pytest.importorskip("mkdocstrings")
    copy = tmp_path / "copy"
    shutil.copytree(ROOT, copy, ignore=shutil.ignore_patterns(".*", "runs", "out", "dist", "build", "*.egg-info"))
    if not good:
        with open(copy / "docs" / "limits.md", "a", encoding="utf-8") as stream:
            stream.write("\n[x](nowhere.md)\n")
    words = [sys.executable, str(copy / "scripts" / "docs_site.py"), str(tmp_path / "site")]
    assert (subprocess.run(words, capture_output=True, check=False).returncode == 0) == good
