#!/usr/bin/env python3
"""Every link of the installed guides leads to a file: check_installed_links.py FOLDER_OF_GUIDES"""
import pathlib
import re
import sys

guides = sorted(pathlib.Path(sys.argv[1]).rglob("*.md"))
links = [(guide, link) for guide in guides for link in re.findall(r"\]\(([^)#:]+)[^):]*\)", guide.read_text())]
dead = [f"{guide.name}: {link} is not there" for guide, link in links if not (guide.parent / link).exists()]
print(f"{len(links)} links in {len(guides)} guides")
sys.exit("\n".join(dead) or not links)
