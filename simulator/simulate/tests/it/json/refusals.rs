//! Invalid JSON scenes: exit code 2, one message with place and remedy, no file changed.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use super::{INTEGRATOR, JSON, OBJ, folder_of, load};
use crate::support::{simulate, stderr};

/// Runs `simulate` on the files, and asserts all that every refusal has in common. Returns the message.
fn refuse_in(folder: &Path, name: &str, options: &[&str]) -> String {
    fs::write(folder.join("earlier.csv"), "an earlier trace\n").unwrap();
    let before = contents(folder);
    let call =
        ["scene.json", "--integrator", INTEGRATOR, "-o", "new.bin", "--energy", "earlier.csv"];
    let run = simulate(folder, &[&call[..], options].concat());
    let message = stderr(&run).to_owned();
    assert_eq!(run.status.code(), Some(2), "{name}: {message}");
    assert_eq!(run.stdout, b"", "{name}");
    assert_eq!(contents(folder), before, "{name}: a file appeared, went or changed");
    assert!(!message.contains("panicked"), "{name}: {message}");
    assert_eq!(message.lines().count(), 2, "{name}: not two lines: {message}");
    message
}

/// Names and contents of the files in the folder; the contents of no large one.
fn contents(folder: &Path) -> BTreeSet<(PathBuf, Option<Vec<u8>>)> {
    let file = |entry: std::io::Result<fs::DirEntry>| {
        let path = entry.unwrap().path();
        let is_small = path.metadata().is_ok_and(|file| file.is_file() && file.len() < 1 << 20);
        let bytes = is_small.then(|| fs::read(&path).unwrap());
        (path, bytes)
    };
    fs::read_dir(folder).unwrap().map(file).collect()
}

/// As [`refuse_in`], for files of which one is wrong at its mark, or the first as a whole.
fn refuse(name: &str, json: &str, obj: &str, options: &[&str], says: &str, help: &str) {
    let place = [("scene.json", json), ("mesh.obj", obj)].into_iter().find_map(|(file, marked)| {
        let (before, _) = marked.split_once('¶')?;
        let line = before.matches('\n').count() + 1;
        let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
        Some(format!("error: {file}:{line}:{column}: "))
    });
    let place = place.unwrap_or("error: scene.json: ".to_owned());
    let folder = folder_of(json.replace('¶', ""), obj.replace('¶', ""));
    let message = refuse_in(folder.path(), name, options);
    assert_message(name, &message, &place, says, help);
}

fn assert_message(name: &str, message: &str, place: &str, says: &str, help: &str) {
    let (what, remedy) = message.split_once('\n').unwrap();
    assert!(what.starts_with(place) && what.contains(says), "{name}: {place}{says}\n{message}");
    assert!(remedy.starts_with("  help: ") && remedy.contains(help), "{name}: {help}\n{message}");
}

/// The rows of a table with the columns
/// `name | what is replaced | by what | what the message says | its remedy`.
fn rows(table: &'static str, good: &str) -> Vec<[String; 4]> {
    let row = |row: &str| {
        let columns: Vec<&str> = row.split('|').map(str::trim).collect();
        let [name, old, new, says, help] = columns[..] else { panic!("not five columns: {row}") };
        assert_eq!(good.matches(old).count(), 1, "{name}: {old} is not in the file once");
        assert!(!says.is_empty() && !help.is_empty(), "{name}");
        [name, &good.replace(old, &new.replace("\\n", "\n")), says, help].map(str::to_owned)
    };
    table.trim().lines().map(row).collect()
}

#[test]
fn a_json_file_without_a_scene_is_refused() {
    let write = "write an object that names a mesh";
    for (name, json, says) in [
        ("empty", "", "the file is empty"),
        ("blank", " \n\t\r\n", "the file is empty"),
        ("a list", "\n ¶[1, 2]", "a JSON scene must be an object"),
        ("a number", "¶12", "a JSON scene must be an object"),
        ("null", "¶null", "a JSON scene must be an object"),
    ] {
        refuse(name, json, OBJ, &[], says, write);
    }
    let correct = "correct the text here";
    refuse("a word", "¶hello", OBJ, &[], "not well-formed JSON: expected value", correct);
    refuse("XML", "¶<scene/>", OBJ, &[], "not well-formed JSON: expected value", correct);
    refuse("more", "{\"k\": 1}\n¶{}", OBJ, &[], "not well-formed JSON: trailing", correct);
    let lost = "restore the lost end";
    refuse("cut in a key", "{\"k¶", OBJ, &[], "the file ends too early: EOF while", lost);
    refuse("cut in a list", "{\"b\": [1, 2¶\n\n", OBJ, &[], "EOF while parsing a list", lost);
    refuse("cut after a key", "{\n\"grüße\": 1,\n\"b\":¶", OBJ, &[], "EOF while parsing", lost);
}

#[test]
fn every_truncation_of_a_json_file_is_refused() {
    let whole = JSON.trim_end();
    for length in 0..whole.len() {
        let folder = folder_of(&whole[..length], OBJ);
        let message = refuse_in(folder.path(), &format!("{length} bytes"), &[]);
        assert!(message.starts_with("error: scene.json:"), "{length} bytes: {message}");
    }
}

#[test]
fn a_wrong_value_is_named_at_its_place() {
    let table = r#"
        no comma | [1, 3] | [1 ¶3] | not well-formed JSON: expected `,` or `]` | correct the text
        NaN | 100 | ¶NaN | not well-formed JSON: expected value | correct the text
        a comment | "k" | ¶// "k" | not well-formed JSON: key must be a string | correct the text
        a bad escape | "k" | "gr\¶qüße": 1, "k" | invalid escape | correct the text
        half an emoji | "k" | ¶"\ud800": 1, "k" | not well-formed JSON: | correct the text
        no obj | "obj": "mesh.obj", |  | there is no key "obj" | "obj": "net.obj"
        obj a number | "mesh.obj" | ¶1 | "obj": 1 must be a string | give "obj"
        obj null | "mesh.obj" | ¶null | "obj": null must be a string | give "obj"
        obj empty | "mesh.obj" | ¶"" | "obj": "" must be the name of a file | give "obj"
        obj missing | "mesh.obj" | ¶"no.obj" | the mesh no.obj cannot be read: No such file | name an OBJ file
        obj a folder | "mesh.obj" | ¶"." | the mesh . cannot be read: is a directory | name an OBJ file
        obj a device | "mesh.obj" | ¶"/dev/zero" | which is not below the scene's folder | put the file into the scene's folder
        obj impossible | "mesh.obj" | ¶"a\u0000b" | cannot be read: | name an OBJ file
        no k | "k": 100, |  | there is no key "k" | "k": 100
        k a string | 100 | ¶"100" | "k": "100" must be a finite number, 0 or more | give "k"
        k negative | 100 | ¶-1 | "k": -1 must be a finite number, 0 or more | give "k"
        k too large | 100 | ¶1e999 | "k": 1e999 is out of the range of an f64 | below 1.8e308
        k a list | 100 | ¶[100] | "k": [100] must be a finite number | give "k"
        k twice | "m": 2, | "m": 2, ¶"k": 3, | the key "k" is given a second time; the first is at line 3 | keep one
        k twice in other letters | "m": 2, | "m": 2, ¶"\u006b": 3, | the key "k" is given a second time | keep one
        m zero | 2, | ¶0, | "m": 0 must be a finite number above 0 | give "m"
        m too small | 2, | ¶1e-999, | "m": 1e-999 must be a finite number above 0 | give "m"
        m null | 2, | ¶null, | "m": null must be a finite number | give "m"
        wind a number | true | ¶1 | "wind": 1 must be true or false | give "wind"
        png a number | "cloth.png" | ¶1 | "png": 1 must be a string | give "png"
        b zero | [1, 3] | [1, ¶0] | "b" pins vertex 0, and there is no such vertex | has 5 vertices, counted from 1
        b too large | [1, 3] | [1,\n  ¶6] | "b" pins vertex 6, and there is no such vertex | has 5 vertices
        b negative | [1, 3] | ¶-1 | "b" pins vertex -1, and there is no such vertex | has 5 vertices
        b infinite | [1, 3] | ¶1e999 | "b": 1e999 must be a whole number | give "b"
        b huge | [1, 3] | ¶1e99 | there is no such vertex | has 5 vertices
        b not whole | [1, 3] | [¶1.5] | "b": 1.5 must be a whole number | give "b"
        b a string | [1, 3] | [1, ¶"2"] | "b": "2" must be a whole number | give "b"
        b a list of lists | [1, 3] | [¶[1], [3]] | "b": [1] must be a whole number | give "b"
        b an object | [1, 3] | ¶{} | "b": {} must be a whole number | give "b"
    "#;
    for [name, json, says, help] in rows(table, JSON) {
        refuse(&name, &json, OBJ, &[], &says, &help);
    }
}

#[test]
fn a_wrong_mesh_is_named_at_its_place() {
    let table = r#"
        no number | v 0 2 0 | v 0 ¶two 0 | "two" is not a number | 0.5 or 1e-3
        a comma | v 0 2 0 | v 0 ¶2,0 0 | "2,0" is not a number | 0.5 or 1e-3
        NaN | v 0 2 0 | v 0 2 ¶nan | "nan" is not a finite number | below 1.8e308
        too large | v 0 2 0 | v ¶1e999 2 0 | "1e999" is not a finite number | below 1.8e308
        a colour that is none | v 0 2 0 | v 0 2 0 1 1 ¶red | "red" is not a number | 0.5 or 1e-3
        two coordinates | v 0 2 0 | ¶v 0 2 | "v" has 2 numbers | the coordinates x y z
        no coordinates | v 0 2 0 | ¶v | "v" has 0 numbers | the coordinates x y z
        five numbers | v 0 2 0 | ¶v 0 2 0 1 1 | "v" has 5 numbers | a weight and a colour
        face of none | l 4 5 | ¶f | "f" joins fewer than two vertices | name two
        face of one | l 4 5 | ¶f 1 | "f" joins fewer than two vertices | name two
        line of one | l 4 5 | ¶l 5 | "l" joins fewer than two vertices | name two
        vertex 0 | f 1 2 3 4 | f 1 ¶0 3 | there is no vertex 0 | the mesh has 5 vertices
        vertex 6 | f 1 2 3 4 | f 1 2 3 ¶6/1 | there is no vertex 6/1 | the mesh has 5 vertices, counted from 1
        vertex -6 | f 1 2 3 4 | f 1 ¶-6 3 | there is no vertex -6 | the mesh has 5 vertices
        vertex 2^32 | f 1 2 3 4 | f 1 ¶4294967297 | there is no vertex 4294967297 | the mesh has 5 vertices
        vertex -2^63 | f 1 2 3 4 | f 1 ¶-9223372036854775808 | there is no vertex -9223372036854775808 | the mesh
        vertex 2^63 | f 1 2 3 4 | f 1 ¶9223372036854775808 | does not name a vertex | its number from 1 up
        half a vertex | f 1 2 3 4 | f 1 2 ¶1.5 | "1.5" does not name a vertex | its number from 1 up
        no vertex | f 1 2 3 4 | f 1 2 ¶/1/2 | "/1/2" does not name a vertex | its number from 1 up
        a bad texture | f 1 2 3 4 | f 1 2 ¶3/x | "3/x" does not name a vertex | 1/2/3 with texture and normal
        four parts | f 1 2 3 4 | f 1 2 ¶3/1/1/1 | "3/1/1/1" does not name a vertex | 1/2/3
        twice in a face | f 1 2 3 4 | f 1 2 3 ¶1 | names vertex 1 twice | join different vertices
        twice in a face, backwards | f 1 2 3 4 | f 1 ¶-5 3 | names vertex 1 twice | join different vertices
        twice in a line | l 4 5 | l 4 5 ¶5 4 | names vertex 5 twice | join different vertices
        a spring too long | v 0 2 0 | v 0 1e200 0 \n f ¶1 5 | between vertices 1 and 5 is too long | use units
        on a later line | l 4 5 | l 4 \ \n ¶x | "x" does not name a vertex | its number
        continued by nothing | l 4 5 | l 4 5 ¶\ | ends in a backslash, and no line follows | remove the backslash
    "#;
    for [name, obj, says, help] in rows(table, OBJ) {
        refuse(&name, JSON, &obj, &[], &says, &help);
    }
}

#[test]
fn invalid_mesh_is_refused() {
    let whole = |name: &str, obj: &[u8], place: &str, says: &str, help: &str| {
        let folder = folder_of(JSON, obj);
        assert_message(name, &refuse_in(folder.path(), name, &[]), place, says, help);
    };
    let check = "check that this is an OBJ file";
    whole("empty", b"", "error: mesh.obj: ", "the mesh has no vertices", check);
    whole("prose", b"to be\ndone\n", "error: mesh.obj: ", "the mesh has no vertices", check);
    whole("faces only", b"f 1 2 3\n", "error: mesh.obj: ", "the mesh has no vertices", check);
    whole(
        "bytes",
        b"v 0 0 0\n# gr\xfc\n",
        "error: mesh.obj:2:5: ",
        "not UTF-8 text: invalid byte 0xfc",
        "",
    );
    let folder = folder_of(b"{\n\"\xff\": 1}", OBJ);
    let message = refuse_in(folder.path(), "bytes in JSON", &[]);
    assert_message(
        "bytes",
        &message,
        "error: scene.json:2:2: ",
        "not UTF-8 text: invalid byte 0xff",
        "",
    );
}

#[test]
fn a_vertex_without_mass_is_named() {
    let json = JSON.replace("\"m\": 2,", "");
    let alone = OBJ.replace("v 0 2 0", "¶v 0 2 0");
    let says = "vertex 5 has no mass: the scene has no \"m\", and no face at it has an area";
    refuse("on a line only", &json, &alone, &[], says, "\"m\": 1");
    let flat = "¶v 0 0 0\nv 1 1 1\nv 3 3 3\nf 1 2 3";
    refuse("in a flat face", &json, flat, &[], "vertex 1 has no mass", "\"m\": 1");
    let point = "¶v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3";
    refuse("in a point", &json, point, &[], "vertex 1 has no mass", "\"m\": 1");
    let large = "¶v 0 0 0\nv 1e100 0 0\nv 0 1e100 0\nf 1 2 3";
    refuse(
        "too large",
        &json,
        large,
        &[],
        "area of the faces at vertex 1 is out of the range",
        "units",
    );
}

#[test]
fn doubtful_input_warns_and_is_an_error_under_strict() {
    let json = r#"
        key | "k" | ¶"zzz": [{}], "k" | unknown key "zzz" | remove it
        key in capitals | "png" | ¶"Wynd": 1, "png" | unknown key "Wynd" | remove it
        key misspelt | "wind": true | ¶"wnd": true | unknown key "wnd" | did you mean "wind"?
        key by its meaning | "m": 2, | "m": 2, ¶"textures": 1, | unknown key "textures" | remove it
        key by another name | "b" | ¶"pinned" | unknown key "pinned" | did you mean "b"?
        pinned twice | [1, 3] | [1, 3, ¶1] | "b" pins vertex 1 a second time | keep one
    "#;
    let obj = r#"
        statement | l 4 5 | ¶lines 4 5 | the statement "lines" adds no vertex and no spring | remove it
        free form | l 4 5 | ¶curv 0 1 4 5 | the statement "curv" adds no vertex | remove it
        a spring twice | l 4 5 | l 4 5 \n f ¶5 4 | vertices 5 and 4 are joined a second time | one spring counts
        no springs | f 1 2 3 4 |  | no springs | join vertices
    "#;
    let in_json = rows(json, JSON)
        .into_iter()
        .map(|[name, json, says, help]| (name, json, OBJ.to_owned(), says, help));
    let in_obj = rows(obj, OBJ)
        .into_iter()
        .map(|[name, obj, says, help]| (name, JSON.to_owned(), obj, says, help));
    for (name, json, mut obj, says, help) in in_json.chain(in_obj) {
        if name == "no springs" {
            obj = obj.replace("l 4 5", "").replace("v 0 0 0", "¶v 0 0 0");
        }
        refuse(&name, &json, &obj, &["--strict"], &says, &help);
        let folder = folder_of(json.replace('¶', ""), obj.replace('¶', ""));
        let parsed = load(&folder.path().join("scene.json"), false).unwrap();
        let [warning] = &parsed.warnings[..] else { panic!("{name}: {:?}", parsed.warnings) };
        assert!(warning.to_string().contains(&says), "{name}: {warning}");
        assert_eq!(parsed.n_warnings, 1, "{name}");
    }
    let folder = folder_of(JSON, "zzz\n".repeat(150) + OBJ);
    let parsed = load(&folder.path().join("scene.json"), false).unwrap();
    assert_eq!((parsed.warnings.len(), parsed.n_warnings), (100, 150));
}

#[test]
fn deep_and_large_json_is_bounded() {
    let deep = format!("{{\"deep\": {}{}, ", "[".repeat(1 << 20), "]".repeat(1 << 20));
    let folder = folder_of(JSON.replacen('{', &deep, 1), OBJ);
    assert_eq!(load(&folder.path().join("scene.json"), false).unwrap().n_warnings, 1);
    refuse(
        "a million lists",
        &format!("¶{}", "[".repeat(1 << 20)),
        OBJ,
        &[],
        "must be an object",
        "",
    );
    let pins =
        JSON.replace("[1, 3]", &format!("[¶{}1{}]", "[".repeat(1 << 20), "]".repeat(1 << 20)));
    refuse("a million lists in b", &pins, OBJ, &[], "[[[… must be a whole number", "");

    for (large, place) in [("scene.json", "scene.json"), ("mesh.obj", "mesh.obj")] {
        let folder = folder_of(JSON, OBJ);
        // The file is sparse: it takes no room.
        fs::File::create(folder.path().join(large)).unwrap().set_len(1 << 30).unwrap();
        let message = refuse_in(folder.path(), large, &[]);
        let says = "the file has 1073741824 bytes, and a scene may have at most 268435456";
        assert_message(large, &message, &format!("error: {place}: "), says, "split the scene");
    }

    let polygon: String = (1..=5000).map(|vertex| format!(" {vertex}")).collect();
    let vertices: String = (1..=5000).map(|x| format!("v {x} 0 0\n")).collect();
    let obj = format!("{vertices}f ¶{}\n", polygon.trim_start());
    refuse("a face of 5,000", JSON, &obj, &[], "more than 10000000 pairs", "coarser mesh");
    // A thousand times the same pairs count as often.
    let obj = format!("v 0 0 0\nv 1 0 0\nv 2 0 0\n{}", "f 1 2 3\n".repeat(1000));
    assert_eq!(
        load(&folder_of(JSON.replace("[1, 3]", "[]"), &obj).path().join("scene.json"), true)
            .unwrap()
            .scene
            .edges
            .len(),
        3
    );
}

#[test]
fn neither_file_of_the_scene_is_written_over() {
    for (output, what) in [("mesh.obj", "the scene's mesh"), ("scene.json", "the scene")] {
        let folder = folder_of(JSON, OBJ);
        let before = contents(folder.path());
        let call = ["scene.json", "--integrator", INTEGRATOR, "--format", "csv", "-o", output];
        let run = simulate(folder.path(), &call);
        let message = format!(
            "error: the trace and {what} cannot be one file\n  help: give each output a name of its own\n"
        );
        assert_eq!((run.status.code(), stderr(&run)), (Some(2), &*message));
        assert_eq!(contents(folder.path()), before);
    }
}

/// A scene of somebody else names files by paths, through links and in its mesh.
#[cfg(unix)]
#[test]
fn a_confined_scene_reads_no_file_outside_its_folder() {
    let folder = tempfile::TempDir::new().unwrap();
    let inside = folder.path().join("inside");
    fs::create_dir_all(inside.join("meshes")).unwrap();
    fs::write(folder.path().join("mesh.obj"), OBJ).unwrap();
    fs::write(inside.join("meshes/mesh.obj"), OBJ).unwrap();
    std::os::unix::fs::symlink("../mesh.obj", inside.join("link.obj")).unwrap();
    let absolute = folder.path().join("mesh.obj");
    let read = |mesh: &str, png: &str, options: &[&str]| {
        let scene = format!("{{\"k\": 1, \"m\": 1,\n \"obj\": {mesh:?}, \"png\": {png:?}}}");
        fs::write(inside.join("scene.json"), scene).unwrap();
        let call = ["scene.json", "-o", "trace.csv"];
        let run = simulate(&inside, &[&call[..], options].concat());
        (run.status.code(), stderr(&run).to_owned())
    };
    for mesh in [absolute.to_str().unwrap(), "../mesh.obj", "meshes/../../mesh.obj", "link.obj"] {
        assert_eq!(read(mesh, "a.png", &["--unconfined"]).0, Some(0), "{mesh}");
        let (code, message) = read(mesh, "a.png", &[]);
        assert!(code == Some(2) && message.contains("scene.json:2:9: \"obj\" names"), "{message}");
        assert!(message.contains("which is not below the scene's folder"), "{message}");
    }
    let (code, message) = read("meshes/mesh.obj", "../a.png", &[]);
    assert!(code == Some(2) && message.contains("\"png\" names"), "{message}");
    assert_eq!(read("meshes/mesh.obj", "a.png", &[]).0, Some(0));
    let (code, message) = read("/dev/zero", "", &["--unconfined"]);
    assert!(code == Some(2) && message.contains("it is a pipe, a socket or a device"), "{message}");
    // The mesh names a library, and the library a picture.
    let with = |library: &str| format!("mtllib {library}\nusemtl red\n{OBJ}");
    fs::write(folder.path().join("red.mtl"), "newmtl red\nKd 1 0 0\n").unwrap();
    fs::write(inside.join("own.mtl"), "newmtl red\nmap_Kd ../red.png\n").unwrap();
    for (library, notes) in [("../../red.mtl", 1), ("../own.mtl", 1)] {
        fs::write(inside.join("meshes/mesh.obj"), with(library)).unwrap();
        let (code, message) =
            read("meshes/mesh.obj", "", &["--frames", "frames", "--duration", "0"]);
        let found = message.matches("it is not below the scene's folder").count();
        assert_eq!((code, found), (Some(0), notes), "{library}: {message}");
    }
}
