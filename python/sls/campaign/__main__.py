"""`python3 -m sls.campaign`: without what figures and the study need."""

import sys

from sls.campaign.cli import main

sys.exit(main(sys.argv[1:]))
