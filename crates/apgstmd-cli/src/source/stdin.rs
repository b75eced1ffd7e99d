//! Standard input: YUV4MPEG2 or raw grey frames. A thread of its own reads it, since nothing else can wait for it and
//! still hear Ctrl-C.

use std::io::{self, BufRead, IsTerminal};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;

use super::raw::{self, RawFormat};
use super::stream::{Frames, Timed, Waited, wait};
use super::y4m::Header;
use super::{InputFlags, Limit, Switch};
use crate::Outcome;
use crate::failure::{Failure, reason};

type Coming = Result<Timed, String>;

pub(super) struct StdinFrames {
    queue: Receiver<Coming>,
    switch: Switch,
}

impl StdinFrames {
    /// Refuses a terminal.
    pub fn check() -> Outcome {
        if io::stdin().is_terminal() {
            return Err(
                Failure::usage("INPUT is -, but standard input is a terminal: nothing is piped into it").hint(HOW)
            );
        }
        Ok(())
    }

    /// Starts to read.
    ///
    /// # Errors
    /// The system has no more threads.
    pub fn open(flags: InputFlags) -> Outcome<Self> {
        let InputFlags { raw, bit_depth, limit, .. } = flags;
        let (sender, queue) = sync_channel(1);
        thread::Builder::new()
            .name("apgstmd-stdin".to_owned())
            .spawn(move || {
                let mut input = io::stdin().lock();
                let ended = match raw {
                    Some(format) => read_raw(format, bit_depth, &mut input, &sender),
                    None => read_y4m(bit_depth, limit, &mut input, &sender),
                };
                if let Err(reason) = ended {
                    // Nobody listens any more only where nobody wants to know.
                    let _ = sender.send(Err(reason));
                }
            })
            .map_err(|error| Failure::failed(format_args!("cannot start a thread: {}", reason(&error))))?;
        Ok(Self { queue, switch: Switch::default() })
    }
}

/// What can be piped in.
pub(super) const HOW: &str =
    "ffmpeg -i VIDEO -f yuv4mpegpipe -strict -1 - | apgstmd run -, or raw grey frames with --raw WxH";

fn read_raw(
    format: RawFormat,
    bit_depth: Option<u32>,
    input: &mut impl BufRead,
    frames: &SyncSender<Coming>,
) -> Result<(), String> {
    let format = RawFormat { layout: format.layout.with_bit_depth(bit_depth)?, ..format };
    if input.fill_buf().map_err(|error| reason(&error))?.is_empty() {
        return Err("it is empty".to_owned());
    }
    while let Some(picture) = raw::next(format, input)? {
        if frames.send(Ok((picture, None))).is_err() {
            break;
        }
    }
    Ok(())
}

fn read_y4m(
    bit_depth: Option<u32>,
    limit: Limit,
    input: &mut impl BufRead,
    frames: &SyncSender<Coming>,
) -> Result<(), String> {
    let mut header = Header::read(input, limit)?.ok_or("it is empty")?;
    header.layout = header.layout.with_bit_depth(bit_depth)?;
    let mut frame = 0u64;
    while let Some(picture) = header.next(input)? {
        let time = header.rate.map(|rate| frame as f64 / rate);
        if frames.send(Ok((picture, time))).is_err() {
            break;
        }
        frame += 1;
    }
    Ok(())
}

impl Frames for StdinFrames {
    fn next(&mut self) -> Result<Option<Timed>, String> {
        match wait(&self.queue, &self.switch, None) {
            Waited::Came(frame) => frame.map(Some),
            Waited::Ended | Waited::Off | Waited::TooLong => Ok(None),
        }
    }

    fn switch(&self) -> Switch {
        self.switch.clone()
    }
}
