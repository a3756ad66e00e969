//! `simulate generate`: writes a procedural scene.

use std::io::{self, BufWriter, Write};
use std::path::PathBuf;

use clap::builder::{PossibleValue, PossibleValuesParser};
use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches, value_parser};
use scene::output::OutputFile;
use scene::schema::IntegratorSchema;
use scene::write::{self, WriteError};
use scene::{Dimension, MAX_FILE_SIZE, Scene};
use simulator::generate::options::{GeneratorOption, OptionValue, Rule};
use simulator::generate::{GeneratorKind, REGISTRY, parse_integrator, parse_option};

use super::Failure;

/// The scene file to write.
const OUTPUT: &str = "output";

/// The arguments of `simulate generate`: those of the generators' subcommands.
pub(super) struct Generate(ArgMatches);

impl FromArgMatches for Generate {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        Ok(Self(matches.clone()))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        self.0 = matches.clone();
        Ok(())
    }
}

impl Args for Generate {
    fn augment_args(command: Command) -> Command {
        command
            .about("Write a scene of a kind, of any size, as XML")
            .subcommand_required(true)
            .arg_required_else_help(true)
            .subcommands(REGISTRY.iter().map(command_of))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

fn command_of(kind: &'static GeneratorKind) -> Command {
    let mut generator = (kind.default)();
    let options = generator.options();
    let names: Vec<&str> = options.iter().map(|option| option.spec.name).collect();
    let output = Arg::new(OUTPUT)
        .short('o')
        .long(OUTPUT)
        .value_name("SCENE")
        .help("Scene file to write [default: standard output]")
        .help_heading("Stepping and output")
        .value_parser(value_parser!(PathBuf));
    Command::new(kind.name)
        .about(kind.summary)
        .long_about(format!("{}\n\n{}", kind.summary, kind.details))
        .args(options.iter().map(|option| argument(option, &names)))
        .arg(output)
}

/// The argument of an option of a generator, which has the options `names`.
fn argument(option: &GeneratorOption<'_>, names: &[&'static str]) -> Arg {
    let GeneratorOption { spec, help, value } = option;
    let mut arg = Arg::new(spec.name).long(spec.name).help(*help);
    if let Some(short) = spec.short {
        arg = arg.short(short);
    }
    if let Some(heading) = spec.heading {
        arg = arg.help_heading(heading);
    }
    arg = match spec.rule {
        Rule::Free => arg,
        Rule::Alone => {
            arg.conflicts_with_all(names.iter().copied().filter(|name| *name != spec.name))
        }
        Rule::Excludes(other) => arg.conflicts_with(other),
        Rule::Needs(other) => arg.requires(other),
        Rule::DefaultIf { option, is, default } => arg.default_value_if(option, is, default),
    };
    if let OptionValue::Flag(_) = value {
        return arg.action(ArgAction::SetTrue);
    }
    // A negative number is a wrong value, and not an unknown option.
    arg = arg.value_name(spec.value_name).allow_negative_numbers(true);
    let (arg, default) = match value {
        OptionValue::Flag(_) => (arg, None),
        OptionValue::Count(count) => {
            (arg.value_parser(value_parser!(u64)), Some(count.to_string()))
        }
        OptionValue::Number(number) => {
            (arg.value_parser(value_parser!(f64)), Some(number.to_string()))
        }
        OptionValue::MaybeCount(_) => (arg.value_parser(value_parser!(u64)), None),
        OptionValue::MaybeNumber(_) => (arg.value_parser(value_parser!(f64)), None),
        OptionValue::Dimension(dimension) => {
            (arg.value_parser(["2", "3"]), Some(dimension.count().to_string()))
        }
        OptionValue::Choice(choice) => {
            let words = choice.words().into_iter();
            let words = words.map(|(name, help)| PossibleValue::new(name).help(help));
            (arg.value_parser(PossibleValuesParser::new(words)), Some(choice.word().to_owned()))
        }
        OptionValue::Integrator(schema) => {
            (arg.value_parser(parse_integrator), Some(schema.name.to_owned()))
        }
        OptionValue::Settings(_) => {
            (arg.value_parser(parse_option).action(ArgAction::Append), None)
        }
    };
    match default {
        // The parser keeps the text until the program ends.
        Some(default) => arg.default_value(&*default.leak()),
        None => arg,
    }
}

/// Gives an option the value of its argument.
fn set(option: GeneratorOption<'_>, matches: &ArgMatches) {
    let name = option.spec.name;
    match option.value {
        OptionValue::Flag(flag) => *flag = matches.get_flag(name),
        OptionValue::Count(count) => *count = *one(matches, name),
        OptionValue::Number(number) => *number = *one(matches, name),
        OptionValue::MaybeCount(count) => *count = matches.get_one(name).copied(),
        OptionValue::MaybeNumber(number) => *number = matches.get_one(name).copied(),
        OptionValue::Dimension(dimension) => {
            let is_plane = one::<String>(matches, name) == "2";
            *dimension = if is_plane { Dimension::Two } else { Dimension::Three };
        }
        OptionValue::Choice(choice) => choice.choose(one::<String>(matches, name)),
        OptionValue::Integrator(schema) => {
            *schema = *one::<&'static IntegratorSchema>(matches, name)
        }
        OptionValue::Settings(settings) => {
            *settings = matches.get_many(name).into_iter().flatten().cloned().collect();
        }
    }
}

/// The value of an argument with a default.
fn one<'a, T: Clone + Send + Sync + 'static>(matches: &'a ArgMatches, name: &str) -> &'a T {
    matches.get_one(name).expect("the argument has a default")
}

/// Writes the scene that the options describe.
pub(super) fn run(Generate(matches): &Generate) -> Result<(), Failure> {
    let (name, matches) = matches.subcommand().expect("a subcommand is required");
    let kind = REGISTRY.iter().find(|kind| kind.name == name).expect("its name is a generator's");
    let mut generator = (kind.default)();
    for option in generator.options() {
        set(option, matches);
    }
    let scene = generator.scene()?;
    // Scenes that cannot be written or read again are refused before the first byte.
    let size = write::size(&scene)?;
    if size > MAX_FILE_SIZE {
        return Err(Failure::Input(format!(
            "this scene takes {size} bytes, and simulate reads at most {MAX_FILE_SIZE}\n  help: make it smaller"
        )));
    }
    let Some(path) = matches.get_one::<PathBuf>(OUTPUT) else { return print(&scene) };
    let mut file =
        OutputFile::create(path).map_err(|error| Failure::cannot_create(path, &error))?;
    write::write(&scene, &mut file).map_err(|error| Failure::at(path, error))?;
    file.commit().map_err(|error| Failure::at(path, error))
}

fn print(scene: &Scene) -> Result<(), Failure> {
    let mut out = BufWriter::with_capacity(1 << 16, io::stdout().lock());
    match write::write(scene, &mut out).and_then(|()| Ok(out.flush()?)) {
        Err(WriteError::Io(error)) => Failure::of_stdout(Err(error)),
        result => Ok(result?),
    }
}
