int main(int count, char** arguments) {
    if (count == 2 && std::string(arguments[1]) == "--serve") {
        for (std::string scene, trace; std::cin >> scene >> trace;) {
            const int status = simulate(scene, trace);
            if (status != 0) return status;
        }
        return 0;
    }
    if (count != 3) {
        std::cerr << "called as: simulate SCENE TRACE, or simulate --serve\n";
        return 2;
    }
    return simulate(arguments[1], arguments[2]);
}
