"""Makes docs/reference and the man pages from the code's own tables: ./sls reference."""

import argparse
import pathlib
import sys

import man
import pages
import sources


def write(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(prog="./sls reference", description=__doc__)
    parser.add_argument("--build", type=pathlib.Path, default=sources.ROOT / "build", metavar="DIR",
                        help="the build with the programs (default: build)")
    parser.add_argument("--man", type=pathlib.Path, metavar="DIR", help="write the man pages to DIR, and nothing else")
    parser.add_argument("--check", action="store_true", help="write nothing; exit code 1 where a file is stale")
    arguments = parser.parse_args()
    build = arguments.build.resolve()
    try:
        if arguments.man:
            for name, text in man.make(build).items():
                write(arguments.man / name, text)
            return 0
        made = {sources.ROOT / "docs/reference" / name: make(build) for name, make in pages.PAGES.items()}
        stale = [(path, text) for path, text in made.items()
                 if not path.is_file() or path.read_text(encoding="utf-8") != text]
    except sources.StaleReference as error:
        print(f"sls: error: {error}", file=sys.stderr)
        return 1
    for path, text in stale:
        name = path.relative_to(sources.ROOT)
        if arguments.check:
            print(f"{name}: stale; renew it with ./sls reference")
        else:
            write(path, text)
            print(f"wrote {name}")
    return 1 if arguments.check and stale else 0


if __name__ == "__main__":
    sys.exit(main())
