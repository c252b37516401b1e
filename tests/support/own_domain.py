"""A DDS domain for one test; own_domain.hpp is the same in C++."""

from sls import dds_domain


def own_domain():
    """Context with a DDS domain that no other test uses meanwhile."""
    return dds_domain.own_domain(range(1, 61), "test", 240.0)
