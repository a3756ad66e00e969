struct Element {
    std::string name;
    std::map<std::string, std::string> attributes;

    double number(const std::string& attribute) const {
        const auto found = attributes.find(attribute);
        if (found == attributes.end()) {
            std::cerr << "<" << name << "> has no " << attribute << "\n";
            std::exit(1);
        }
        return std::strtod(found->second.c_str(), nullptr);
    }

    double number(const std::string& attribute, double otherwise) const {
        return attributes.count(attribute) > 0 ? number(attribute) : otherwise;
    }
};

// The elements of a scene, in the order of the file: as much XML as scenes need.
std::vector<Element> elements_of(const std::string& path) {
    std::ifstream file(path);
    std::stringstream buffer;
    buffer << file.rdbuf();
    const std::string text = buffer.str();
    std::vector<Element> elements;
    std::size_t at = 0;
    while ((at = text.find('<', at)) != std::string::npos) {
        if (text.compare(at, 4, "<!--") == 0) {
            at = text.find("-->", at);
            continue;
        }
        const std::size_t end = text.find('>', at);
        std::size_t next = text.find_first_of(" \t\r\n/>", at + 1);
        Element element{text.substr(at + 1, next - at - 1), {}};
        while (next < end) {
            const std::size_t name = text.find_first_not_of(" \t\r\n/", next);
            const std::size_t open = text.find_first_of("\"'", name);
            if (name >= end || open >= end) break;
            const std::size_t close = text.find(text[open], open + 1);
            const std::size_t name_end = text.find_first_of(" \t\r\n=", name);
            element.attributes[text.substr(name, name_end - name)] = text.substr(open + 1, close - open - 1);
            next = close + 1;
        }
        elements.push_back(element);
        at = end;
    }
    return elements;
}
