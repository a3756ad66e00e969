if sys.argv[1:] == ["--serve"]:
    for line in sys.stdin:
        simulate(*line.split())
else:
    simulate(*sys.argv[1:])
