// Ends the program: exit code 77 says that the scene needs something that is not implemented, which is no crash.
[[noreturn]] inline void notImplemented(const char* what) {
    std::fprintf(stderr, "%s is not implemented\n", what);
    std::exit(77);
}
