"""Lists every `unsafe` of the crates with its argument, as docs/unsafe.md; fails where one has none.

    python3 tools/unsafe.py > docs/unsafe.md
    python3 tools/unsafe.py --check
"""

import re
import sys
from pathlib import Path

HEAD = """# Every unsafe block

Written by `python3 tools/unsafe.py > docs/unsafe.md`; `--check` fails where it is not up to date, and the list fails to be made
where an argument is missing. `unsafe` is denied for the whole workspace and allowed function by function in
`crates/apgstmd-core/src/row` alone. `make miri`, `make asan` and `make tsan` are for it: see
[reliability](reliability.md).
"""

UNSAFE = re.compile(r"\bunsafe\s+(fn|impl|\{)|\bunsafe \{")
ARGUMENT = re.compile(r"\s*//[/]?\s?(.*)")


def argument(lines: list[str], at: int) -> str:
    """The comment with SAFETY nearest above, or beside, a line: within the statement it stands in."""
    for start in range(at, max(at - 14, -1), -1):
        if "SAFETY:" in lines[start] or "# Safety" in lines[start]:
            words = [lines[start].split("SAFETY:")[-1].split("# Safety")[-1]]
            for line in lines[start + 1 :]:
                found = ARGUMENT.fullmatch(line.rstrip("\n"))
                if not found:
                    break
                words.append(found[1])
            return " ".join(" ".join(words).split())
    return ""


def listed() -> str:
    parts = [HEAD]
    missing = []
    for path in sorted(Path("crates").rglob("*.rs")):
        lines = path.read_text().splitlines(keepends=True)
        rows = []
        for at, line in enumerate(lines):
            code = line.split("//")[0]
            if not UNSAFE.search(code):
                continue
            why = argument(lines, at)
            if not why:
                missing.append(f"{path}:{at + 1}")
            rows.append(f"| `{code.strip().replace('|', chr(92) + '|')}` | {why} |")
        if rows:
            parts.append(f"\n## {path.relative_to('crates')}\n\n| code | why it holds |\n|---|---|\n" + "\n".join(rows) + "\n")
    if missing:
        sys.exit("no argument (SAFETY: ...) for " + ", ".join(missing))
    return "".join(parts)


text = listed()
if "--check" not in sys.argv:
    sys.stdout.write(text)
elif Path("docs/unsafe.md").read_text() != text:
    sys.exit("docs/unsafe.md is not up to date: python3 tools/unsafe.py > docs/unsafe.md")
