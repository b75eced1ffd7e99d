//! What the flags mean together: checked, defaults filled in, nothing left to decide while frames flow.

mod checkpoints;
mod dump;
mod pictures;
mod region;
mod tracks;

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use apgstmd_core::params::{Localise, RejectionMode};
use apgstmd_core::{BankParams, MOST_THREADS, Machine, Model, ParamError, Params, Preset};

pub(crate) use self::dump::parse_range;
pub use self::dump::{DumpSettings, FrameList};
pub use self::pictures::PictureSettings;
pub use self::region::LookIn;
pub use self::tracks::TrackSettings;
use crate::Outcome;
use crate::args::{
    FalseAlarmsArg, Format, FrameArgs, LocaliseArg, ModelArg, ModelArgs, OnError, PresetArg, RejectionArg, RunArgs,
    Speed, Switch,
};
use crate::failure::{Failure, reason, without_snippet};
use crate::source::{Frames, Input, InputFlags, Limit, Place, Selection, Span};
use crate::text::read_settings;

/// Frames a second that something can have: one a day to a million.
const MIN_FPS: f64 = 1e-5;
const MAX_FPS: f64 = 1e6;
/// False alarms a frame that a bank lists where nothing is said: few enough to look at, and enough for whoever wants to
/// choose a threshold later, up to 1 a frame, though the estimate may be out by half.
const USUAL_FALSE_ALARMS: Option<f64> = Some(2.0);
/// Largest target that can be asked for, px.
const LARGEST_TARGET: f64 = 60.0;

/// Everything `apgstmd run` needs.
pub struct RunSettings {
    /// INPUT as given.
    pub input: PathBuf,
    /// Its pictures, scene or stream.
    pub source: Input,
    /// Which frames of it are used.
    pub span: Span,
    /// The same as numbers, where that is known beforehand.
    pub selection: Option<Selection>,
    /// Bits that 16-bit samples use.
    pub bit_depth: Option<u32>,
    /// The model.
    pub params: Params,
    /// The members, where it is a bank of them.
    pub bank: Option<BankParams>,
    /// False alarms a frame that are listed, by the clip itself; all that is found without it.
    pub false_alarms: Option<f64>,
    /// Speed that `params` were scaled to, px/frame, for run.json.
    pub speed: Option<f64>,
    /// Threads and instruction set of the model.
    pub machine: Machine,
    /// Where targets are looked for, if not everywhere.
    pub look_in: Option<LookIn>,
    /// What to do about a bad picture.
    pub on_error: OnError,
    /// Where results go.
    pub destination: Destination,
    /// Tables to write.
    pub formats: Vec<Format>,
    /// What is written of tracks.
    pub tracks: TrackSettings,
    /// Annotated pictures.
    pub overlay: bool,
    /// Video and page.
    pub pictures: PictureSettings,
    /// Inner maps.
    pub dump: Option<DumpSettings>,
    /// Frames from one checkpoint to the next at least, where they are written.
    pub checkpoint: Option<usize>,
    /// Go on with earlier results.
    pub resume: bool,
    /// One small picture of the run.
    pub poster: Option<PathBuf>,
    /// Replace earlier results.
    pub force: bool,
    /// Errors only.
    pub quiet: bool,
}

/// Where results go.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Destination {
    /// A folder.
    Folder(PathBuf),
    /// Detections to stdout, nothing else.
    Stdout,
}

impl RunSettings {
    /// Checks the flags, reads the parameter file, lists the pictures, unless the program around this one gives some.
    ///
    /// # Errors
    /// Anything that makes the run impossible and shows before its first picture.
    pub fn resolve(args: RunArgs, given: Option<Box<dyn Frames>>) -> Outcome<Self> {
        let mut model = args.model.clone();
        if let Some(Speed::PerSecond(_) | Speed::Auto) = model.speed {
            // What is wrong with the others is said before the source is looked at.
            model.speed = None;
        }
        let mut params = resolve_params(&model)?;
        let threads = resolve_threads(args.threads)?;
        let span = check_frames(&args)?;
        let live = args.live.map(|live| live == Switch::Yes);
        let FrameArgs { raw, fps, bit_depth, largest_frame, .. } = args.frames;
        let flags = InputFlags { raw, fps, live, bit_depth, limit: Limit::of_millions(largest_frame) };
        let source = match given {
            Some(frames) => Input::given(frames, flags)?,
            None => Input::of(&args.input, flags)?,
        };
        let selection = source.select(span)?;
        if let Some(Speed::PerSecond(speed)) = args.model.speed {
            model.speed = Some(Speed::PerFrame(speed * seconds_between(&source, span)?));
            params = resolve_params(&model)?;
        }
        let bank = resolve_bank(&args, &model)?;
        let false_alarms = match args.false_alarms {
            Some(FalseAlarmsArg::Rate(rate)) => Some(rate),
            Some(FalseAlarmsArg::Off) => None,
            // A parameter file that names a score means that one.
            None => bank.as_ref().filter(|bank| bank.base.detection.least_score == 0.0).and(USUAL_FALSE_ALARMS),
        };
        let mut formats = args.format.clone();
        let mut seen = HashSet::new();
        formats.retain(|format| seen.insert(*format as u8));
        let destination = destination(args.out.clone(), &args.input, &source)?;
        if destination == Destination::Stdout {
            if formats.len() > 1 {
                return Err(Failure::usage("--out - takes one --format: csv or jsonl"));
            }
            if args.overlay {
                return Err(Failure::usage("--overlay writes pictures, but --out - has no folder for them"));
            }
        }
        let tracks = TrackSettings::resolve(&args, &params, &destination)?;
        let pictures = PictureSettings::resolve(&args, &tracks, &destination)?;
        let dump = DumpSettings::resolve(&args, params.model, (span, selection.as_ref()), &destination)?;
        checkpoints::check(&args, &source, &destination)?;
        Ok(Self {
            input: args.input,
            source,
            span,
            selection,
            bit_depth: args.frames.bit_depth,
            params,
            bank,
            false_alarms,
            speed: match model.speed {
                Some(Speed::PerFrame(speed)) => Some(speed),
                _ => None,
            },
            machine: Machine { threads, simd: args.simd, ..Machine::default() },
            look_in: LookIn::resolve(&args.region)?,
            on_error: args.frames.on_error,
            destination,
            formats,
            tracks,
            overlay: args.overlay,
            pictures,
            dump,
            checkpoint: args.checkpoint,
            resume: args.resume,
            poster: args.child.poster,
            force: args.force,
            quiet: args.quiet,
        })
    }
}

/// Which frames are used, and how they are read, as far as that can be checked without them.
fn check_frames(args: &RunArgs) -> Outcome<Span> {
    if let Some(bits) = args.frames.bit_depth
        && !(9..=16).contains(&bits)
    {
        return Err(Failure::usage(format_args!(
            "--bit-depth is {bits}, but it must be between 9 and 16: how many bits of 16-bit samples are used"
        )));
    }
    if let Some(fps) = args.frames.fps
        && !(MIN_FPS..=MAX_FPS).contains(&fps)
    {
        return Err(Failure::usage(format_args!("--fps is {fps}, but it must be between {MIN_FPS} and {MAX_FPS}")));
    }
    Span::new(args.frames.start, args.frames.stop, args.frames.step)
}

/// What is wrong with the flags of `apgstmd run` whatever INPUT is.
///
/// # Errors
/// Values out of range, flags that exclude each other, an unreadable parameter file or mask.
pub fn check_flags(args: &RunArgs) -> Outcome {
    let mut model = args.model.clone();
    if let Some(Speed::PerSecond(_) | Speed::Auto) = model.speed {
        model.speed = None;
    }
    let params = resolve_params(&model)?;
    check_frames(args)?;
    resolve_bank(args, &model)?;
    LookIn::resolve(&args.region)?;
    let destination = Destination::Folder(args.out.clone().unwrap_or_default());
    TrackSettings::resolve(args, &params, &destination).map(drop)
}

/// The members of a bank, where it is one: nothing tells the speed, or the flags of a bank do.
fn resolve_bank(args: &RunArgs, model: &ModelArgs) -> Outcome<Option<BankParams>> {
    let flags = [("--speeds", !args.bank.speeds.is_empty()), ("--sizes", !args.bank.sizes.is_empty())];
    let asked = flags.iter().find(|(_, given)| *given).map(|(flag, _)| *flag);
    let auto = args.model.speed == Some(Speed::Auto);
    let ModelArgs { model: named, preset, rejection, localise, threshold, .. } = model;
    let file = bank_file(model)?;
    // One particular model is meant: as it stands.
    let particular = args.model.speed.is_some()
        || named.is_some_and(|model| model != ModelArg::ApgStmd)
        || *preset == Some(PresetArg::Paper)
        || model.params.is_some() && file.is_none()
        || rejection.is_some()
        || localise.is_some()
        || threshold.is_some()
        || args.dump.is_some();
    if asked.is_none() && !auto && particular {
        return match args.bank.contrast {
            Some(_) => Err(Failure::usage("--contrast is for a bank: name its --speeds, one or more")),
            None => Ok(None),
        };
    }
    if !args.bank.speeds.is_empty() && args.model.speed.is_some_and(|speed| speed != Speed::Auto) {
        return Err(Failure::usage("--speed and --speeds both name speeds: give one of them"));
    }
    if args.dump.is_some() {
        return Err(Failure::usage(format_args!(
            "--dump looks into one detector, but {} asks for a bank: choose its --speed",
            asked.unwrap_or("--speed auto")
        )));
    }
    if let Some(wrong) = args.bank.sizes.iter().find(|size| !(1.0..=LARGEST_TARGET).contains(*size)) {
        return Err(Failure::usage(format_args!(
            "--sizes has {wrong}, but sizes must be between 1 and {LARGEST_TARGET} px"
        )));
    }
    // The members are tuned from here on.
    let base = resolve_params(&ModelArgs { speed: None, ..model.clone() })?;
    let speed = match model.speed {
        Some(Speed::PerFrame(speed)) => vec![speed],
        _ => args.bank.speeds.clone(),
    };
    let given = |list: &[f64]| !list.is_empty();
    let (speeds, sizes) =
        (Some(&speed[..]).filter(|list| given(list)), Some(&args.bank.sizes[..]).filter(|list| given(list)));
    let mut bank = match file {
        Some(file) if speeds.is_none() && sizes.is_none() => BankParams { base, ..file },
        _ => BankParams::choose(base, speeds, sizes),
    };
    if let Some(contrast) = args.bank.contrast {
        if !(0.0..=1.0).contains(&contrast) {
            return Err(Failure::usage(format_args!("--contrast is {contrast}, but it must be between 0 and 1")));
        }
        bank.contrast = contrast;
    }
    bank.validate().map_err(Failure::usage)?;
    Ok(Some(bank))
}

/// The bank that the parameter file describes, where it does.
fn bank_file(model: &ModelArgs) -> Outcome<Option<BankParams>> {
    let Some(path) = &model.params else { return Ok(None) };
    BankParams::from_toml(&read_params(path)?).map_err(|error| wrong_params(path, &error))
}

fn read_params(path: &Path) -> Outcome<String> {
    read_settings(path).map_err(|error| {
        Failure::usage(format_args!("cannot read the parameters {}: {}", path.display(), reason(&error)))
    })
}

fn wrong_params(path: &Path, error: &ParamError) -> Failure {
    Failure::usage(format_args!("{}: {}", path.display(), without_snippet(error)))
        .hint("`apgstmd params` prints a complete parameter file")
}

/// Seconds from one used frame to the next.
///
/// # Errors
/// INPUT does not tell.
pub fn seconds_between(source: &Input, span: Span) -> Outcome<f64> {
    match (span.step, source.rate()) {
        (Place::Seconds(step), _) => Ok(step),
        (Place::Frames(step), Some(rate)) => Ok(step as f64 / rate),
        (Place::Frames(_), None) => Err(Failure::usage(format_args!(
            "--speed in px/s needs frames a second, which {} does not tell: give them with --fps",
            source.shown()
        ))),
    }
}

/// Parameters in the documented order: model and preset or file, then speed, then single values.
///
/// # Errors
/// An unreadable or wrong file, values out of range.
pub fn resolve_params(args: &ModelArgs) -> Outcome<Params> {
    let mut params = match &args.params {
        Some(path) => {
            let text = read_params(path)?;
            match BankParams::from_toml(&text).map_err(|error| wrong_params(path, &error))? {
                Some(bank) => bank.base,
                None => Params::from_toml(&text).map_err(|error| wrong_params(path, &error))?,
            }
        }
        None => {
            let model = args.model.map_or(Model::ApgStmd, |model| match model {
                ModelArg::ApgStmd => Model::ApgStmd,
                ModelArg::StmdPlus => Model::StmdPlus,
                ModelArg::Dstmd => Model::Dstmd,
                ModelArg::Cascaded => Model::Cascaded,
                ModelArg::Estmd => Model::Estmd,
            });
            match args.preset {
                Some(PresetArg::Practical) => Params::for_model(model).with_preset(Preset::Practical),
                Some(PresetArg::Paper) => Params::for_model(model),
                None => Params::usual(model),
            }
        }
    };
    if let Some(speed) = args.speed {
        let Speed::PerFrame(speed) = speed else {
            return Err(Failure::usage("--speed auto and speeds in px/s are for `apgstmd run`: here it is px/frame"));
        };
        params = params.for_speed(speed).map_err(|error| match error {
            ParamError::Speed { .. } => Failure::usage(format_args!("--speed: {error}")),
            _ => Failure::usage(format_args!("--speed {speed} scales a parameter out of its range: {error}")),
        })?;
    }
    if let Some(mode) = args.rejection {
        params.rejection.mode = match mode {
            RejectionArg::Off => RejectionMode::Off,
            RejectionArg::Contrast => RejectionMode::Contrast,
            RejectionArg::Motion => RejectionMode::Motion,
        };
    }
    if let Some(point) = args.localise {
        params.detection.localise = match point {
            LocaliseArg::Response => Localise::Response,
            LocaliseArg::Target => Localise::Target,
        };
    }
    if let Some(threshold) = args.threshold {
        params.detection.threshold = threshold;
    }
    params.validate().map_err(Failure::usage)?;
    Ok(params)
}

/// `--threads`, or one per core.
///
/// # Errors
/// 0 or too many.
pub fn resolve_threads(threads: Option<usize>) -> Outcome<usize> {
    match threads {
        None => Ok(std::thread::available_parallelism().map_or(1, usize::from).min(MOST_THREADS)),
        Some(threads) if (1..=MOST_THREADS).contains(&threads) => Ok(threads),
        Some(threads) => {
            Err(Failure::usage(format_args!("--threads is {threads}, but it must be between 1 and {MOST_THREADS}")))
        }
    }
}

/// Threads that read pictures ahead beside `threads` that compute: they sleep while their queues are full.
pub fn readers(threads: usize) -> usize {
    const MOST: usize = 4;
    threads.min(MOST)
}

fn destination(out: Option<PathBuf>, input: &Path, source: &Input) -> Outcome<Destination> {
    let folder = match out {
        Some(out) if out.as_os_str() == "-" => return Ok(Destination::Stdout),
        Some(out) if out.as_os_str().is_empty() => return Err(Failure::usage("--out is empty: name a folder, or -")),
        Some(out) => out,
        // `clips/cam0/` -> `cam0-apgstmd` in the current folder.
        None => PathBuf::from(format!("{}-apgstmd", source.name())),
    };
    if let (Ok(to), Ok(pictures)) = (folder.canonicalize(), input.canonicalize())
        && to == pictures
        && input.is_dir()
    {
        return Err(Failure::usage(format_args!(
            "--out {} is the INPUT folder: name another, or the strip of pictures would be read as a frame next time",
            to.display()
        )));
    }
    Ok(Destination::Folder(folder))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_and_presets() {
        let of = |model, preset| resolve_params(&ModelArgs { model, preset, ..ModelArgs::default() }).unwrap();
        assert_eq!(of(None, None), Params::preset(Preset::Practical));
        assert_eq!(of(Some(ModelArg::ApgStmd), None), Params::preset(Preset::Practical));
        assert_eq!(of(Some(ModelArg::Dstmd), None), Params::for_model(Model::Dstmd));
        assert_eq!(of(Some(ModelArg::Dstmd), Some(PresetArg::Paper)), Params::for_model(Model::Dstmd));
        let practical = of(Some(ModelArg::Dstmd), Some(PresetArg::Practical));
        assert_eq!((practical.model, practical.rejection.mode), (Model::Dstmd, RejectionMode::Motion));
    }

    #[test]
    fn single_values_come_after_speed() {
        let args = ModelArgs { speed: Some(Speed::PerFrame(1.0)), threshold: Some(0.5), ..ModelArgs::default() };
        let params = resolve_params(&args).unwrap();
        assert_eq!(params.prediction.horizon, 6);
        assert_eq!(params.detection.threshold, 0.5);
        assert_eq!(params.prediction.beta, 10.0);
    }
}
