import sys

from sls.check.results import describe, refuse

if __name__ == "__main__":
    try:
        from sls.check.cli import main
    except Exception as error:  # numpy or yaml is missing, broken or too old
        sys.exit(refuse(sys.argv[1:], describe(error)))
    sys.exit(main(sys.argv[1:]))
