// Empty: only the way it is linked matters.
