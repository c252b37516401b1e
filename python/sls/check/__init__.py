"""Flights as tests: check files, their flights on several placements, and the verdict. docs/testing-your-controller.md
shows the use, config/checks/README.md describes the keys."""
