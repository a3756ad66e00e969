def read_root(path):
    """The root element of a scene in XML, in two dimensions."""
    if not path.endswith(".xml"):
        not_implemented("this format of scenes")
    root = ElementTree.parse(path).getroot()
    if any(axis in element.keys() for element in root.iter() for axis in ("pz", "vz", "fz")):
        not_implemented("a scene in three dimensions")
    return root
