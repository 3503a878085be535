# SPDX-License-Identifier: Apache-2.0
"""Generated pages of the site: ROS interfaces, commands, and the C++ headers with comments for their parser."""

import contextlib
import io
import os
import re
from pathlib import Path

from hpccd_ros import cli

ROOT = Path(__file__).resolve().parent.parent


def everything(pages: Path, headers: Path) -> None:
    """Write the generated pages to `pages` and the headers to `headers`."""
    _write(pages / "interfaces.md", interfaces())
    _write(pages / "commands.md", commands())
    _write(pages / "contributing.md", site_links((ROOT / "CONTRIBUTING.md").read_text(), ROOT, pages))
    for header in (ROOT / "hpccd_core" / "include" / "hpccd").glob("*.h"):
        _write(headers / "hpccd" / header.name, block_comments(header.read_text()))


def _write(path: Path, text: str) -> None:
    """Leaves a file alone that has this text: Sphinx reads what has changed."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.exists() or path.read_text() != text:
        path.write_text(text)


def interfaces() -> str:
    """The reference of the messages, services and actions, from their files."""
    lines = ["# ROS interfaces", "", "Generated from the files in `msg`, `srv` and `action`.", ""]
    for folder, parts in (("msg", [""]), ("srv", ["Request", "Response"]), ("action", ["Goal", "Result", "Feedback"])):
        for file in sorted((ROOT / folder).iterdir()):
            lines += [f"## hpccd/{folder}/{file.stem}", ""]
            text = file.read_text().removeprefix("# SPDX-License-Identifier: Apache-2.0\n")
            for part, fields in zip(parts, re.split(r"^---$", text, flags=re.MULTILINE), strict=True):
                lines += [f"### {part}", ""] if part else []
                lines += _fields(fields)
    return "\n".join(lines)


def _fields(text: str) -> list[str]:
    """Each field with the comment in front of it as a definition; comments of no field as paragraphs."""
    lines: list[str] = []
    for block in re.findall(r"(?:^#.*\n)*(?:^[^#\n].*\n)*", text + "\n", re.MULTILINE):
        comment = [line[1:].removeprefix(" ") for line in block.splitlines() if line.startswith("#")]
        fields = [line.partition("#") for line in block.splitlines() if not line.startswith("#")]
        words = [*_paragraphs(comment), *(trailing.strip() for *_, trailing in fields if trailing)]
        if not fields:
            lines += [*words, ""]
            continue
        named = [field.strip().split(maxsplit=1) for field, *_ in fields]
        lines.append(", ".join(f"**{name}** `{kind}`" for kind, name in named))  # the term of a definition is one line
        lines += [f"{': ' if not k else '  '}{line}".rstrip() for k, line in enumerate(words)] + [""]
    return lines


def _paragraphs(comment: list[str]) -> list[str]:
    """A comment as Markdown: what it indents is a list."""
    lines: list[str] = []
    for line in comment:
        if line.startswith("  ") and not (lines and lines[-1].startswith("- ")):
            lines.append("")
        lines.append(f"- {line.strip()}" if line.startswith("  ") else line)
    return lines


def commands() -> str:
    """The page with the `--help` of each command."""
    os.environ["COLUMNS"] = "100"
    lines = ["# Commands", "", "Generated from `--help`.", ""]
    for name in ["", *cli.COMMANDS]:
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed), contextlib.suppress(SystemExit):
            cli.main([*filter(None, [name]), "--help"])
        lines += [f"## hpccd {name}".rstrip(), "", "```text", printed.getvalue().rstrip(), "```", ""]
    return "\n".join(lines)


def block_comments(header: str) -> str:
    """A header with `///` comments as `/** */` ones, trailing ones in front of what they describe."""
    header = re.sub(r"^inline namespace \w+ {\n|^}  // namespace v\w+\n", "", header, flags=re.MULTILINE)
    header = re.sub(r"^( *)(.*?) *///< (.*)$", r"\1/// \3\n\1\2", header, flags=re.MULTILINE)

    def block(match: re.Match) -> str:
        text = re.sub(r"^ *///", "", match.group(0), flags=re.MULTILINE)
        text = re.sub(r"(?<!`)`(?!`)", "``", text)  # code, in the markup that the reader knows
        return "/**" + text.rstrip() + "\n*/\n"

    return re.sub(r"(^ *///(?!<).*\n)+", block, header, flags=re.MULTILINE)


def site_links(text: str, folder: Path, page_folder: Path) -> str:
    """The text of a page of `folder`, for one in `page_folder`: links to what is no page of the site become names."""

    def named(match: re.Match) -> str:
        words, target = match.groups()
        file, _, anchor = target.partition("#")
        anchor = "" if file.endswith("README.md") else anchor  # the first page of the site has other headings
        if "://" in target or not file:
            return match.group(0)
        path = (folder / file).resolve()
        path = {
            ROOT / "README.md": ROOT / "docs" / "index.md",
            ROOT / "CONTRIBUTING.md": ROOT / "docs" / "generated" / "contributing.md",
        }.get(path, path)
        if path.is_relative_to(ROOT / "docs"):
            return f"[{words}]({os.path.relpath(path, page_folder)}{'#' if anchor else ''}{anchor})"
        name = str(path.relative_to(ROOT))
        return words if name in words else f"{words} (`{name}`)"

    return re.sub(r"(?<!!)\[([^\]]+)\]\(([^)\s]+)\)", named, text)
