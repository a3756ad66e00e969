def not_implemented(what):
    """Ends the program: exit code 77 says that the scene needs something that is not implemented, which is no crash."""
    print(f"{what} is not implemented", file=sys.stderr)
    sys.exit(77)
