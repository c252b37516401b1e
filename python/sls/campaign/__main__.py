"""`python3 -m sls.campaign`. It does not import the packages that figures and the study need."""

import sys

from sls.campaign.cli import main

sys.exit(main(sys.argv[1:]))
