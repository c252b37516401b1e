// Nothing: how it is linked is what matters.
