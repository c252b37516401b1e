"""A measure of the user, for the tests."""


def peak(flight):
    return 1.0
