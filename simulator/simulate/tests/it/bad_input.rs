//! Invalid scenes and command lines: exit code 2, one message with place and remedy, no file changed.
//!
//! In the scenes of this file the sign ¶ marks the place that the message must name. It is taken out
//! before the scene is written.

use std::fs;
use std::path::Path;

use crate::support::{simulate, stderr};
use tempfile::TempDir;

/// A scene with one of everything that can be got wrong. Nothing is wrong with it.
const GOOD: &str = r#"<scene>
  <duration time="1"/>
  <integrator type="symplectic-euler" dt="0.25"/>
  <particle m="2" px="0.5" py="0" vx="0" vy="1" fixed="0"/>
  <particle m="3" px="1.5" py="0" vx="0" vy="0" fixed="1" radius="0.2"/>
  <edge i="0" j="1" radius="0.01"/>
  <springforce edge="0" k="10" l0="0.7" b="0.3"/>
  <gravitationalforce i="0" j="1" G="0.2"/>
  <vortexforce i="1" j="0" kbs="0.4" kvc="0.6"/>
  <dragdamping b="0.9"/>
  <particlecolor i="1" r="0.1" g="0.2" b="1"/>
</scene>
"#;

const EARLIER: &[u8] = b"an earlier trace\n";

/// Runs `simulate` on the scene, once onto an earlier trace and once onto nothing, and asserts all that
/// every refusal has in common. Returns the message.
fn refuse(name: &str, scene: &[u8], options: &[&str]) -> String {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("scene.xml"), scene).unwrap();
    refuse_in(folder.path(), name, &[&["scene.xml"], options].concat())
}

fn refuse_in(folder: &Path, name: &str, arguments: &[&str]) -> String {
    fs::write(folder.join("earlier.csv"), EARLIER).unwrap();
    let before = listing(folder);
    let outputs = [
        ["-o", "earlier.csv", "--energy", "new.csv"],
        ["-o", "new.bin", "--energy", "earlier.csv"],
    ];
    let [message, same] = outputs.map(|output| {
        let run = simulate(folder, &[arguments, &output].concat());
        let message = stderr(&run);
        assert_eq!(run.status.code(), Some(2), "{name}: {message}");
        assert_eq!(run.stdout, b"", "{name}");
        assert_eq!(listing(folder), before, "{name}: a file appeared or went");
        assert_eq!(fs::read(folder.join("earlier.csv")).unwrap(), EARLIER, "{name}");
        message.to_owned()
    });
    assert_eq!(message, same, "{name}");
    assert!(!message.contains("panicked"), "{name}: {message}");
    let errors = message.lines().filter(|line| line.starts_with("error:")).count();
    assert_eq!(errors, 1, "{name}: {message}");
    message
}

/// As [`refuse`], for a scene that is wrong at its mark, or as a whole if it has none.
fn refuse_scene(name: &str, marked: &str, options: &[&str], says: &str, help: &str) {
    let place = match marked.split_once('¶') {
        Some((before, _)) => {
            let line = before.matches('\n').count() + 1;
            let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
            format!("error: scene.xml:{line}:{column}: ")
        }
        None => "error: scene.xml: ".to_owned(),
    };
    let message = refuse(name, marked.replace('¶', "").as_bytes(), options);
    let lines: Vec<&str> = message.lines().collect();
    let [what, remedy] = lines[..] else { panic!("{name}: not two lines: {message}") };
    assert!(what.starts_with(&place) && what.contains(says), "{name}: {place}{says}\n{message}");
    assert!(remedy.starts_with("  help: ") && remedy.contains(help), "{name}: {help}\n{message}");
}

/// The rows of a table with the columns
/// `name | what is replaced in GOOD | by what | what the message says | its remedy`,
/// of which the last may be empty; with [`GOOD`] so spoilt in place of the second and third.
fn spoilt(table: &'static str) -> impl Iterator<Item = [String; 4]> {
    table.trim().lines().map(|row| {
        let columns: Vec<&str> = row.split('|').map(str::trim).collect();
        let [name, old, new, says, help] = columns[..] else { panic!("not five columns: {row}") };
        assert_eq!(GOOD.matches(old).count(), 1, "{name}: {old} is not in the scene once");
        assert_ne!(says, "", "{name}");
        [name, &GOOD.replace(old, new), says, help].map(str::to_owned)
    })
}

fn refuse_each(table: &'static str) {
    for [name, marked, says, help] in spoilt(table) {
        refuse_scene(&name, &marked, &[], &says, &help);
    }
}

/// Names and sizes of what is in the folder.
fn listing(folder: &Path) -> Vec<(String, u64)> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| {
        let entry = entry.unwrap();
        (entry.file_name().into_string().unwrap(), entry.metadata().unwrap().len())
    });
    let mut entries: Vec<_> = entries.collect();
    entries.sort();
    entries
}

#[test]
fn base_scene_of_the_cases_is_valid() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("scene.xml"), GOOD).unwrap();
    let run = simulate(folder.path(), &["scene.xml", "--strict", "-o", "trace.csv"]);
    assert_eq!((run.status.code(), stderr(&run)), (Some(0), ""));
    assert_eq!(fs::read_to_string(folder.path().join("trace.csv")).unwrap().lines().count(), 6);
}

#[test]
fn a_scene_that_cannot_be_read_is_named() {
    let folder = TempDir::new().unwrap();
    fs::create_dir(folder.path().join("folder")).unwrap();
    for (name, says) in [("missing.xml", "cannot be read: "), ("folder", "directory")] {
        let message = refuse_in(folder.path(), name, &[name]);
        assert!(message.starts_with(&format!("error: {name}: ")), "{message}");
        assert!(message.contains(says) && message.contains("\n  help: "), "{message}");
    }
}

#[test]
fn a_file_without_a_scene_is_refused() {
    let root = "whose root element is <scene>";
    refuse_scene("empty", "", &[], "the file is empty", root);
    refuse_scene("blank", " \r\n\t\n", &[], "the file is empty", root);
    refuse_scene("only a byte order mark", "\u{feff}", &[], "the file is empty", root);
    refuse_scene("only a comment", "<!-- <scene/> -->", &[], "there is no <scene> element", root);
    refuse_scene("only text", "\n  ¶to be written", &[], "\"to be written\" stands outside", "");
    let enclose = "enclose everything in <scene>";
    refuse_scene("wrong root", "<?xml version='1.0'?>\n¶<Scene/>", &[], "is <Scene>, not", enclose);
    refuse_scene("another format", "¶<svg><g/></svg>", &[], "the root element is <svg>", enclose);
    let two = GOOD.to_owned() + "¶<scene></scene>";
    refuse_scene(
        "two roots",
        &two,
        &[],
        "more than one root element: <scene>",
        "the first <scene>",
    );
    let after = GOOD.to_owned() + "\n ¶more";
    refuse_scene("text after the root", &after, &[], "\"more\" stands outside of the root", "");
}

#[test]
fn truncated_file_names_the_open_element() {
    let cut = |at: &str, mark: &str| {
        let kept = &GOOD[..GOOD.find(at).unwrap()];
        let (before, after) = kept.rsplit_once(mark).unwrap();
        format!("{before}¶{mark}{after}")
    };
    let list = cut("  <edge", "<scene>");
    refuse_scene("in the list of elements", &list, &[], "ends inside <scene>", "</scene>");
    let tag = cut(" fixed=\"1\"", "<particle");
    refuse_scene("inside a tag", &tag, &[], "tag not closed", "correct the markup");
    let value = cut("0.7\"", "<springforce");
    refuse_scene("inside a value", &value, &[], "attribute value not closed", "correct the markup");
    let comment = "<scene>¶<!-- never closed";
    refuse_scene("inside a comment", comment, &[], "comment not closed", "correct the markup");
}

#[test]
fn every_truncation_of_a_file_is_refused() {
    let folder = TempDir::new().unwrap();
    let whole = GOOD.trim_end();
    for length in 0..whole.len() {
        fs::write(folder.path().join("scene.xml"), &whole[..length]).unwrap();
        let run = simulate(folder.path(), &["scene.xml", "-o", "new.csv"]);
        let message = stderr(&run);
        assert_eq!(run.status.code(), Some(2), "{length} bytes: {message}");
        assert!(message.starts_with("error: scene.xml:"), "{length} bytes: {message}");
        assert_eq!(listing(folder.path()).len(), 1, "{length} bytes: a file appeared");
    }
}

#[test]
fn a_binary_file_is_refused_where_it_stops_being_text() {
    let mut random = fastrand::Rng::with_seed(1);
    // 0xff is in no UTF-8 text.
    let noise: Vec<u8> = (0..4096).map(|_| random.u8(..)).chain([0xff]).collect();
    let message = refuse("random bytes", &noise, &[]);
    assert!(message.contains("this is not UTF-8 text"), "{message}");

    let spoilt =
        [b"<scene>\n  <!-- gr\xc3\xbc\xc3\x9fe ".as_slice(), b"\xff -->\n</scene>"].concat();
    let message = refuse("a byte in a comment", &spoilt, &[]);
    assert_eq!(
        message.lines().next(),
        Some("error: scene.xml:2:14: this is not UTF-8 text: invalid byte 0xff")
    );

    let utf16: Vec<u8> = "\u{feff}<scene/>".encode_utf16().flat_map(u16::to_le_bytes).collect();
    let message = refuse("UTF-16", &utf16, &[]);
    assert!(
        message.starts_with("error: scene.xml:1:1: this is not UTF-8 text: invalid byte 0xff"),
        "{message}"
    );

    let message = refuse("valid UTF-8 of zeros", &[0; 512], &[]);
    assert!(message.starts_with("error: scene.xml:1:1: this is not well-formed XML"), "{message}");
}

#[test]
fn markup_that_is_not_well_formed_is_refused_at_its_place() {
    refuse_each(
        r#"
        end tag | </scene> | ¶</scenes> | `</scene>`, but `</scenes>` was | correct the markup
        end without start | </scene> | </scene>¶</edge> | `</edge>` does not match | correct the markup
        unquoted value | m="3" | m=¶3 | in <particle>, a value has no quotes | correct the markup
        no closing quote | <duration time="1" | ¶<duration time="1 | value not closed | correct the markup
        twice | j="1" radius | j="1" ¶i="2" radius | in <edge>, an attribute is given twice | correct the markup
        no equals sign | b="0.9" | b¶ | in <dragdamping>, an attribute has no value | correct the markup
        no value | b="0.9" | b= ¶ | in <dragdamping>, a value is missing | correct the markup
        unknown entity | px="1.5" | ¶px="&foo;" | unrecognized entity `foo` | correct the markup
        unknown entity in text | <edge | ¶&wind;<edge | there is no entity &wind; | correct the markup
        no character | px="1.5" | ¶px="&#xD800;" | not a valid codepoint | correct the markup
        "#,
    );
}

#[test]
fn faults_of_duration_and_integrator_are_refused() {
    refuse_each(
        r#"
        no duration | <duration time="1"/> |  | no <duration> | <duration time="10"/>
        no time | <duration time="1"/> | ¶<duration/> | no attribute "time" | add time=
        time NaN | time="1" | ¶time="NaN" | time="NaN" must be a finite number |
        time negative | time="1" | ¶time="-1" | time="-1" must be | 0 or more
        time twice | <particle m="2" | ¶<duration time="1"/><particle m="2" | second <duration>; the first is at line 2 | keep one
        too many steps | <duration time="1" | ¶<duration time="2.5e11" | is 1e12 steps | at most 1e9 steps
        no integrator | <integrator type="symplectic-euler" dt="0.25"/> |  | no <integrator> | <integrator type=
        two integrators | <edge | ¶<integrator type="implicit" dt="1"/><edge | second <integrator>; the first is at line 3 | keep one
        no type | <integrator type="symplectic-euler" | ¶<integrator | no attribute "type" | add type=
        type misspelt | type="symplectic-euler" | ¶type="simplectic-euler" | unknown integrator type "simplectic-euler" | did you mean "symplectic-euler"?
        type unknown | type="symplectic-euler" | ¶type="adams" | unknown integrator type "adams" | known types: explicit-euler, symplectic-euler,
        no dt | <integrator type="symplectic-euler" dt="0.25" | ¶<integrator type="symplectic-euler" | no attribute "dt" | add dt=
        dt in capitals | <integrator type="symplectic-euler" dt="0.25" | ¶<integrator type="symplectic-euler" Dt="1" | no attribute "dt" |
        dt zero | dt="0.25" | ¶dt="0" | dt="0" must be a finite number above 0 | give dt
        dt minus zero | dt="0.25" | ¶dt="-0.0" | dt="-0.0" must be a finite number above 0 |
        dt negative | dt="0.25" | ¶dt="-0.1" | dt="-0.1" must be a finite number above 0 |
        dt NaN | dt="0.25" | ¶dt="nan" | dt="nan" must be a finite number above 0 |
        dt infinite | dt="0.25" | ¶dt="inf" | dt="inf" must be a finite number above 0 |
        dt too large | dt="0.25" | ¶dt="1e400" | dt="1e400" is out of the range of an f64 | below 1.8e308
        dt too small | dt="0.25" | ¶dt="1e-400" | dt="1e-400" must be a finite number above 0 |
        dt empty | dt="0.25" | ¶dt="" | dt="" is not a number | 0.5 or 1e-3
        dt a word | dt="0.25" | ¶dt="abc" | dt="abc" is not a number |
        dt with a comma | dt="0.25" | ¶dt="0,25" | dt="0,25" is not a number |
        more updates than the most | type="symplectic-euler" | type="projected-newton" max_iterations="2" ¶min_iterations="5" | min_iterations="5" must be at most max_iterations, which is 2 | give min_iterations
        dt with a unit | dt="0.25" | ¶dt="0.25s" | dt="0.25s" is not a number |
        "#,
    );
}

#[test]
fn overflowing_step_count_is_refused() {
    let scene = GOOD.replace("<duration time=\"1\"", "¶<duration time=\"1e308\"");
    refuse_scene("infinitely many", &scene.replace("0.25", "1e-308"), &[], "is inf steps", "1e9");
    let long = GOOD.replace("<duration time=\"1\"", "¶<duration time=\"1e300\"");
    refuse_scene(
        "hundreds of digits",
        &long,
        &[],
        "duration 1e300 s at a time step of 0.25 s",
        "1e9",
    );
    // The step is the caller's: it is the scene's duration that it is too short for.
    let scene = GOOD.replace("<duration", "¶<duration");
    refuse_scene(
        "by --dt",
        &scene,
        &["--dt", "1e-12"],
        "at a time step of 0.000000000001 s",
        "1e9",
    );
}

#[test]
fn a_particle_needs_a_mass_a_place_and_a_velocity() {
    refuse_each(
        r#"
        mass zero | m="3" | ¶m="0" | must be a finite number above 0 | give m a value
        mass negative | m="3" | ¶m="-1" | must be a finite number above 0 |
        mass NaN | m="3" | ¶m="NaN" | must be a finite number above 0 |
        no mass | <particle m="3" | ¶<particle | <particle> has no attribute "m" | add m=
        no px | <particle m="3" px="1.5" | ¶<particle m="3" | no attribute "px" |
        a position too large | px="1.5" | ¶px="1e400" | px="1e400" is out of the range | 1.8e308
        a position too small | px="1.5" | ¶px="-1e400" | px="-1e400" is out of the range |
        a velocity that is none | vy="1" | ¶vy="up" | vy="up" is not a number |
        no fixed | <particle m="3" px="1.5" py="0" vx="0" vy="0" fixed="1" | ¶<particle m="3" px="1.5" py="0" vx="0" vy="0" | no attribute "fixed" | add fixed=
        fixed 2 | fixed="1" | ¶fixed="2" | fixed="2" must be 0 (free) or 1 (fixed) |
        fixed true | fixed="1" | ¶fixed="true" | fixed="true" must be 0 |
        radius negative | radius="0.2" | ¶radius="-1" | radius="-1" must be | 0 or more
        colour too bright | b="1" | ¶b="1.5" | b="1.5" must be between 0 and 1 |
        "#,
    );
}

#[test]
fn a_scene_without_particles_is_refused() {
    let scene = "<scene><duration time=\"1\"/><integrator type=\"implicit\" dt=\"1\"/></scene>";
    refuse_scene("no particles", scene, &[], "no <particle> element", "<particle m=");
    let scene = scene.replace("</scene>", "<edge ¶i=\"0\" j=\"1\"/></scene>");
    refuse_scene(
        "an edge of none",
        &scene,
        &[],
        "i=\"0\": there is no such particle",
        "the scene has no particle",
    );
}

#[test]
fn references_must_name_existing_elements() {
    refuse_each(
        r#"
        edge to nowhere | <edge i="0" j="1" | <edge i="0" ¶j="2" | <edge> j="2": there is no such particle | the scene has 2 of them: particles 0 to 1
        edge from -1 | <edge i="0" | <edge ¶i="-1" | <edge> i="-1" is not a whole number from 0 up | numbered 0, 1, 2
        edge to 0.5 | <edge i="0" | <edge ¶i="0.5" | i="0.5" is not a whole number |
        edge to 2^64 | <edge i="0" | <edge ¶i="18446744073709551616" | is not a whole number |
        edge to itself | <edge i="0" j="1" | <edge i="1" ¶j="1" | <edge> names particle 1 twice | two different particles
        no j | <edge i="0" j="1" | ¶<edge i="0" | <edge> has no attribute "j" |
        spring on no edge | edge="0" | ¶edge="1" | <springforce> edge="1": there is no such edge | the scene has one edge: number 0
        gravitation to nowhere | <gravitationalforce i="0" j="1" | <gravitationalforce i="0" ¶j="7" | <gravitationalforce> j="7": there is no such particle | the scene has 2 of them: particles 0 to 1
        gravitation to itself | <gravitationalforce i="0" j="1" | <gravitationalforce i="0" ¶j="0" | <gravitationalforce> names particle 0 twice |
        vortex to nowhere | <vortexforce i="1" | <vortexforce ¶i="2" | <vortexforce> i="2": there is no such particle | the scene has 2 of them: particles 0 to 1
        vortex to itself | <vortexforce i="1" j="0" | <vortexforce i="1" ¶j="1" | <vortexforce> names particle 1 twice |
        colour of none | <particlecolor i="1" | <particlecolor ¶i="2" | <particlecolor> i="2": there is no such particle | the scene has 2 of them: particles 0 to 1
        "#,
    );
}

#[test]
fn invalid_force_parameters_are_refused() {
    refuse_each(
        r#"
        stiffness negative | k="10" | ¶k="-10" | k="-10" must be a finite number, 0 or more |
        rest length negative | l0="0.7" | ¶l0="-0.7" | l0="-0.7" must be a finite number, 0 or more |
        damping negative | b="0.3" | ¶b="-0.3" | <springforce> b="-0.3" must be | 0 or more
        drag negative | b="0.9" | ¶b="-0.9" | <dragdamping> b="-0.9" must be | 0 or more
        G infinite | G="0.2" | ¶G="-inf" | G="-inf" must be a finite number |
        no kvc | <vortexforce i="1" j="0" kbs="0.4" kvc="0.6" | ¶<vortexforce i="1" j="0" kbs="0.4" | <vortexforce> has no attribute "kvc" | add kvc=
        no fx | <dragdamping | ¶<simplegravity fy="1"/><dragdamping | <simplegravity> has no attribute "fx" |
        "#,
    );
}

#[test]
fn unmodelled_physics_is_refused_by_name() {
    for tag in [
        "collision",
        "Halfplane",
        "rigidbody",
        "collisiondetection",
        "rigidbodyspringforce",
        // Any force that is not known, and not a known one misspelt.
        "penaltyforce",
        "dragForce",
    ] {
        let scene = GOOD.replace("<edge", &format!("¶<{tag} type=\"x\"/><edge"));
        refuse_scene(
            tag,
            &scene,
            &[],
            &format!("<{tag}> changes the physics"),
            "remove the element",
        );
    }
}

#[test]
fn unknown_markup_warns_and_is_an_error_under_strict() {
    let unknown = r#"
        element | <edge | ¶<sprinforce/><edge | unknown element <sprinforce> | did you mean <springforce>?
        strange element | <edge | ¶<zzz/><edge | unknown element <zzz> | remove it
        attribute | radius="0.2" | ¶radios="0.2" | <particle> has an unknown attribute "radios" | did you mean "radius"?
        force in other letters | <dragdamping b="0.9"/> | ¶<dragDamping b="0.9"/> | unknown element <dragDamping> | did you mean <dragdamping>?
        strange attribute | radius="0.2" | ¶zzz="0.2" | unknown attribute "zzz" | remove it
        attribute of the root | <scene> | <scene ¶version="1"> | <scene> has an unknown attribute | remove it
        text | <edge | ¶wind<edge | text between the elements: "wind" | <!-- ... -->
        second viewport | </scene> | <viewport cx="0" cy="0" size="1"/>¶<viewport cx="0" cy="0" size="2"/></scene> | second <viewport>; the first is at line 12 | the last one counts
    "#;
    for [name, marked, says, help] in spoilt(unknown) {
        refuse_scene(&name, &marked, &["--strict"], &says, &help);

        let folder = TempDir::new().unwrap();
        fs::write(folder.path().join("scene.xml"), marked.replace('¶', "")).unwrap();
        let run = simulate(folder.path(), &["scene.xml", "-o", "trace.csv"]);
        let message = stderr(&run);
        assert_eq!(run.status.code(), Some(0), "{name}: {message}");
        assert!(message.starts_with("warning: scene.xml:"), "{name}: {message}");
        assert!(message.contains(&says) && message.contains(&help), "{name}: {message}");
        assert_eq!(message.lines().count(), 2, "{name}: {message}");
        assert!(folder.path().join("trace.csv").exists(), "{name}");
    }
}

#[test]
fn elements_inside_an_element_are_refused() {
    let scene = GOOD.replace("<edge", "<edge i=\"1\" j=\"0\">¶<dragdamping b=\"1\"/></edge><edge");
    let says = "<edge> may not contain other elements, but contains <dragdamping>";
    refuse_scene("drag inside an edge", &scene, &[], says, "close <edge .../> before");
}

#[test]
fn entities_are_not_expanded() {
    let mut bomb =
        String::from("<?xml version=\"1.0\"?>\n¶<!DOCTYPE scene [\n<!ENTITY a0 \"lol\">\n");
    for level in 1..20 {
        let tenfold = format!("&a{};", level - 1).repeat(10);
        bomb += &format!("<!ENTITY a{level} \"{tenfold}\">\n");
    }
    bomb += "]>\n<scene><description text=\"&a19;\"/></scene>";
    refuse_scene(
        "billion laughs",
        &bomb,
        &[],
        "a document type declaration",
        "remove the <!DOCTYPE",
    );
    let external = "¶<!DOCTYPE scene SYSTEM \"file:///etc/passwd\"><scene>&x;</scene>";
    refuse_scene("external", external, &[], "a document type declaration", "remove the <!DOCTYPE");
}

#[test]
fn nesting_beyond_32_levels_is_refused() {
    let nest = |depth: usize, mark: &str| {
        format!("{}{mark}{}", "<scene>".repeat(32), "<scene>".repeat(depth))
    };
    let scene = nest(100_000, "¶") + &"</scene>".repeat(100_032);
    refuse_scene("deep", &scene, &[], "more than 32 deep", "a flat list of elements");
    refuse_scene("deep and never closed", &nest(100_000, "¶"), &[], "more than 32 deep", "");
}

#[test]
fn gigabyte_scene_is_refused_by_size() {
    let folder = TempDir::new().unwrap();
    // The file is sparse: it takes no room, and would take minutes to read as a scene.
    let file = fs::File::create(folder.path().join("scene.xml")).unwrap();
    file.set_len(1 << 30).unwrap();
    drop(file);
    let message = refuse_in(folder.path(), "1 GiB", &["scene.xml"]);
    assert_eq!(
        message,
        "error: scene.xml: the file has 1073741824 bytes, and a scene may have at most 268435456\n  \
         help: split the scene, or check that this is the right file\n"
    );
}

/// Two particles on a line, the first of them fixed at 0, and what acts between them.
fn pair(dt: f64, integrator: &str, x: f64, v: f64, force: &str) -> String {
    format!(
        r#"<scene>
<duration time="{duration}"/>
<integrator type="{integrator}" dt="{dt}"/>
<particle m="1" px="0" py="0" vx="0" vy="0" fixed="1"/>
<particle m="1" px="{x}" py="0" vx="{v}" vy="0" fixed="0"/>
<edge i="0" j="1"/>
  {force}
</scene>"#,
        duration = 200.0 * dt
    )
}

const PAIR_FORCES: [(&str, &str); 4] = [
    ("springforce", r#"¶<springforce edge="0" k="0" l0="1"/>"#),
    ("springforce", r#"¶<springforce edge="0" k="0" l0="0" b="0.001"/>"#),
    ("gravitationalforce", r#"¶<gravitationalforce i="0" j="1" G="0"/>"#),
    ("vortexforce", r#"¶<vortexforce i="0" j="1" kbs="0" kvc="0"/>"#),
];

#[test]
fn coincident_particles_are_named_with_line_and_step() {
    for (tag, force) in PAIR_FORCES {
        let says =
            format!("step 1 (from t = 0 s): <{tag}> has no direction: particles 0 and 1 are");
        for integrator in ["explicit-euler", "symplectic-euler", "linearized-implicit", "implicit"]
        {
            let scene = pair(0.25, integrator, 0.0, 0.0, force);
            refuse_scene(&format!("{tag} {integrator}"), &scene, &[], &says, "move one of them");
        }
    }
}

#[test]
fn particles_that_meet_later_are_refused_at_the_step_in_which_they_meet() {
    for (tag, force) in PAIR_FORCES {
        if force.contains("b=") {
            // Its damping slows the particle, so that they do not meet exactly.
            continue;
        }
        // From 1 at -1/2: at 0 after 8 steps of 1/4. Explicit methods look there in the step after.
        for (integrator, step, time) in [("symplectic-euler", 9, "2"), ("implicit", 8, "1.75")] {
            let says = format!(
                "step {step} (from t = {time} s): <{tag}> has no direction: particles 0 and 1"
            );
            let scene = pair(0.25, integrator, 1.0, -0.5, force);
            refuse_scene(
                &format!("{tag} {integrator}"),
                &scene,
                &[],
                &says,
                "shorten the time step",
            );
        }
    }
}

#[test]
fn a_spring_without_rest_length_and_damping_needs_no_direction() {
    let force = r#"<springforce edge="0" k="5" l0="0" b="0"/>"#;
    for integrator in ["explicit-euler", "symplectic-euler", "linearized-implicit", "implicit"] {
        let folder = TempDir::new().unwrap();
        let scene = pair(0.25, integrator, 0.0, 0.0, force);
        fs::write(folder.path().join("scene.xml"), scene).unwrap();
        let run = simulate(folder.path(), &["scene.xml", "-o", "trace.csv"]);
        assert_eq!((run.status.code(), stderr(&run)), (Some(0), ""), "{integrator}");
        let trace = fs::read_to_string(folder.path().join("trace.csv")).unwrap();
        assert_eq!(trace.lines().last(), Some("200,50.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0"));
    }
}

#[test]
fn overflow_ends_the_run_at_its_step() {
    // x'' = -1e6 x by explicit Euler: each step multiplies by about 1000.
    let (mut x, mut v, mut step) = (1.0_f64, 0.0_f64, 0);
    while x.is_finite() && v.is_finite() {
        (x, v, step) = (x + v, v - 1e6 * x, step + 1);
    }
    assert!((90..120).contains(&step) && x.is_finite(), "the velocity is the first, at {step}");
    let force = r#"<springforce edge="0" k="1e6" l0="0"/>"#;
    let scene = pair(1.0, "explicit-euler", 1.0, 0.0, force);
    let says = format!(
        "step {step} (from t = {} s): the velocity of particle 1 is no longer finite (coordinate x)",
        step - 1
    );
    // Without energies, which would leave the range of numbers first.
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("scene.xml"), &scene).unwrap();
    let run = simulate(folder.path(), &["scene.xml", "-o", "trace.csv"]);
    let message = stderr(&run);
    assert_eq!(run.status.code(), Some(2), "{message}");
    assert!(
        message.contains(&says) && message.contains("help: shorten the time step"),
        "{message}"
    );
    assert_eq!(listing(folder.path()).len(), 1);
    refuse_scene("energies", &scene, &[], "the energy of the state is not finite", "check masses");
}

#[test]
fn a_step_of_implicit_euler_without_a_solution_is_refused() {
    // On the line, a step from rest at x₀ to x > 0 solves x − x₀ = −h² G/x². The least of x + h² G/x² is
    // 3/2 (2 h² G)^(1/3) = 1.89 for h = G = 1, so that from 1 there is no such x; and a step to x < 0
    // would need a force away from the attracting particle.
    let force = r#"<gravitationalforce i="0" j="1" G="1"/>"#;
    let scene = pair(1.0, "implicit-euler", 1.0, 0.0, force);
    let says = "step 1 (from t = 0 s): Newton's method did not converge: after 100 iterations the update is ";
    refuse_scene("no solution", &scene, &[], says, "shorten the time step");
    let message = refuse("no solution", scene.as_bytes(), &[]);
    let (_, residual) = message.lines().next().unwrap().rsplit_once("the residual ").unwrap();
    assert!(residual.trim().parse::<f64>().unwrap() > 1e-3, "{message}");
    // With a shorter step there is one.
    let shorter = ["scene.xml", "--dt", "0.1", "--duration", "0.1"];
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("scene.xml"), scene).unwrap();
    assert_eq!(simulate(folder.path(), &shorter).status.code(), Some(0));
}

#[test]
fn velocities_too_large_for_newtons_tolerance_are_reported() {
    let drag = r#"<dragdamping b="0.3"/>"#;
    let scene = pair(0.1, "implicit-euler", 1.0, 1e8, drag);
    let says = "its tolerance is below the rounding of velocities of size ";
    refuse_scene("fast", &scene, &[], says, "choose units");
}

#[test]
fn positions_too_large_for_newtons_tolerance_are_reported() {
    // A stiff spring of length 1e6 is stretched by 0.1: its particle can be put to 1e-10, which is 1e-7 over a step of 1e-3.
    let spring = |l0: &str| format!(r#"<springforce edge="0" k="1e9" l0="{l0}"/>"#);
    let scene = pair(1e-3, "implicit-euler", 1e6 + 0.1, 0.3, &spring("1e6"));
    let says = "its tolerance of 1e-9 for an update of the velocities is below 3.6e-6, the rounding of positions of size \
                1.0e6 over a step of 1e-3 s; after 100 iterations the update is ";
    refuse_scene("far", &scene, &[], says, "move the scene towards the origin");
    let near = pair(1e-3, "implicit-euler", 1.1, 0.3, &spring("1"));
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("scene.xml"), near).unwrap();
    assert_eq!(simulate(folder.path(), &["scene.xml"]).status.code(), Some(0));
}

#[test]
fn a_failure_after_the_first_states_writes_none_of_them() {
    // A trace of a megabyte is well beyond every buffer when the particles meet.
    let scene = pair(1.0 / 16384.0, "symplectic-euler", 1.0, -0.5, PAIR_FORCES[0].1);
    let scene = scene.replace('¶', "");
    let message = refuse("late", scene.as_bytes(), &["--duration", "10"]);
    assert!(message.contains(": step 32769 (from t = 2 s): "), "{message}");
}

#[test]
fn wrong_usage_is_refused_before_writing() {
    let calls: [(&str, &[&str], &str); 16] = [
        (
            "dt zero",
            &["scene.xml", "--dt", "0"],
            "'--dt <SECONDS>': it must be a number of seconds above 0",
        ),
        ("dt negative", &["scene.xml", "--dt", "-0.5"], "it must be a number of seconds above 0"),
        ("dt NaN", &["scene.xml", "--dt", "nan"], "it must be a number of seconds above 0"),
        ("dt infinite", &["scene.xml", "--dt", "inf"], "it must be a number of seconds above 0"),
        (
            "duration negative",
            &["scene.xml", "--duration", "-1"],
            "it must be a number of seconds, 0 or more",
        ),
        (
            "duration NaN",
            &["scene.xml", "--duration", "NaN"],
            "it must be a number of seconds, 0 or more",
        ),
        (
            "integrator",
            &["scene.xml", "--integrator", "foo"],
            "known types: explicit-euler, symplectic-euler, linearized-implicit-euler, implicit-euler",
        ),
        (
            "integrator misspelt",
            &["scene.xml", "--integrator", "simplectic-euler"],
            "did you mean \"symplectic-euler\"? known types: explicit-euler",
        ),
        (
            "diagram as PNG",
            &["scene.xml", "--plot", "x.png"],
            "x.png: diagrams are written as SVG\n  help: give it a name that ends in .svg",
        ),
        (
            "more updates than the most",
            &["scene.xml", "--integrator", "projected-newton", "--option", "min_iterations=1001"],
            "takes no min_iterations=\"1001\": it must be at most max_iterations, which is 1000",
        ),
        ("display", &["-s", "scene.xml", "-d", "1"], "invalid value '1' for '-d <0>'"),
        ("two scenes", &["scene.xml", "-s", "scene.xml"], "cannot be used with"),
        ("no scene", &[], "required arguments were not provided"),
        ("unknown option", &["scene.xml", "--fast"], "unexpected argument '--fast'"),
        ("unknown format", &["scene.xml", "--format", "json"], "invalid value 'json'"),
        ("empty scene name", &[""], ""),
    ];
    for (name, arguments, says) in calls {
        let folder = TempDir::new().unwrap();
        fs::write(folder.path().join("scene.xml"), GOOD).unwrap();
        let message = refuse_in(folder.path(), name, arguments);
        assert!(message.starts_with("error: ") && message.contains(says), "{name}: {message}");
        assert!(message.contains("--help") || message.contains("  help: "), "{name}: {message}");
    }
}

#[test]
fn an_output_that_cannot_be_written_is_refused() {
    let outputs: [(&str, &[&str]); 5] = [
        ("nowhere/trace.csv", &["-o", "nowhere/trace.csv"]),
        ("folder.csv", &["-o", "folder.csv"]),
        ("nowhere/energy.csv", &["--energy", "nowhere/energy.csv"]),
        ("folder.csv", &["--energy", "folder.csv"]),
        // The trace could be written, but the call as a whole is wrong.
        ("nowhere/energy.csv", &["-o", "trace.csv", "--energy", "nowhere/energy.csv"]),
    ];
    for (path, arguments) in outputs {
        let folder = TempDir::new().unwrap();
        fs::write(folder.path().join("scene.xml"), GOOD).unwrap();
        fs::create_dir(folder.path().join("folder.csv")).unwrap();
        let before = listing(folder.path());
        let run = simulate(folder.path(), &[&["scene.xml"], arguments].concat());
        let message = stderr(&run);
        assert_eq!(run.status.code(), Some(2), "{arguments:?}: {message}");
        assert!(message.starts_with(&format!("error: {path}: ")), "{arguments:?}: {message}");
        assert!(message.contains("\n  help: name a file in a folder"), "{arguments:?}: {message}");
        assert_eq!(message.lines().count(), 2, "{arguments:?}: {message}");
        assert_eq!(listing(folder.path()), before, "{arguments:?}");
    }
}

#[test]
fn an_extension_that_names_no_format_is_refused() {
    for output in ["trace.txt", "trace", "trace.CSV", "csv"] {
        let folder = TempDir::new().unwrap();
        fs::write(folder.path().join("scene.xml"), GOOD).unwrap();
        let run = simulate(folder.path(), &["scene.xml", "-o", output]);
        assert_eq!(run.status.code(), Some(2), "{output}");
        let message = format!(
            "error: {output}: the extension is not that of a trace format\n  \
             help: name it .csv or .bin, or add --format csv or --format fosssim\n"
        );
        assert_eq!(stderr(&run), message);
        assert_eq!(listing(folder.path()).len(), 1, "{output}: a file appeared");
    }
}

#[cfg(unix)]
#[test]
fn pipe_as_scene_is_refused_without_blocking() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["scene.xml", "scene.json", "mesh.obj"] {
        let made = std::process::Command::new("mkfifo").arg(folder.path().join(name)).status();
        assert!(made.unwrap().success());
    }
    fs::write(folder.path().join("net.json"), r#"{"obj": "mesh.obj", "k": 1, "m": 1}"#).unwrap();
    for name in ["scene.xml", "scene.json", "net.json", "/dev/zero"] {
        let output = simulate(folder.path(), &[name]);
        assert_eq!(output.status.code(), Some(2), "{name}");
        let message = "cannot be read: it is a pipe, a socket or a device, and not a regular file";
        assert!(stderr(&output).contains(message), "{name}: {}", stderr(&output));
    }
}

#[test]
fn quoted_scene_text_cannot_control_a_terminal() {
    let scene = GOOD.replace("<particlecolor", "<e\u{1b}]0;x\u{7}\u{202e}");
    let message = refuse("control", scene.as_bytes(), &["--strict"]);
    assert!(message.contains("<e\u{fffd}]0;x\u{fffd}\u{fffd}>"), "{message:?}");
}
