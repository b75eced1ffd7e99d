//! What ffmpeg is to open, and only that: a file by its literal name, without playlists reaching for the network; an
//! address, without reaching for files.

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};

/// Something that ffmpeg opens.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Location {
    /// A video file.
    File(PathBuf),
    /// A camera of Video4Linux.
    Camera(PathBuf),
    /// A camera in the network.
    Rtsp(String),
    /// A video or stream from a web server.
    Http(String),
}

impl Location {
    /// A camera or an address; files are found by looking.
    pub fn of(input: &Path) -> Option<Self> {
        let text = input.to_str()?;
        if text.starts_with("/dev/video") {
            return Some(Self::Camera(input.to_owned()));
        }
        let (scheme, rest) = text.split_once("://")?;
        match scheme.to_ascii_lowercase().as_str() {
            _ if rest.is_empty() => None,
            "rtsp" | "rtsps" => Some(Self::Rtsp(text.to_owned())),
            "http" | "https" => Some(Self::Http(text.to_owned())),
            _ => None,
        }
    }

    /// Whether it goes on in its own time, and what is not taken is lost.
    pub fn is_live(&self) -> bool {
        matches!(self, Self::Camera(_) | Self::Rtsp(_))
    }

    /// Whether it may stop answering.
    pub fn may_stall(&self) -> bool {
        !matches!(self, Self::File(_))
    }

    /// The arguments of ffmpeg and ffprobe that open it.
    pub fn arguments(&self) -> Vec<OsString> {
        let mut arguments: Vec<OsString> = Vec::new();
        let mut add = |words: &[&str]| arguments.extend(words.iter().map(OsString::from));
        match self {
            Self::File(path) => {
                add(&["-protocol_whitelist", "file,pipe", "-i"]);
                // Otherwise `concat:a|b` and `pipe:0` are no names, nor is what begins with a dash.
                let mut name = OsString::from("file:");
                name.push(path);
                arguments.push(name);
            }
            Self::Camera(path) => {
                add(&["-f", "v4l2", "-i"]);
                arguments.push(path.into());
            }
            Self::Rtsp(url) => {
                add(&[
                    "-protocol_whitelist",
                    "rtsp,rtsps,rtp,srtp,udp,tcp,tls,crypto",
                    "-rtsp_transport",
                    "tcp",
                    "-i",
                    url,
                ]);
            }
            Self::Http(url) => add(&["-protocol_whitelist", "http,https,httpproxy,tcp,tls,crypto,data", "-i", url]),
        }
        arguments
    }

    /// How tables, messages and records name it: without the password of an address.
    pub fn shown(&self) -> String {
        match self {
            Self::File(path) | Self::Camera(path) => path.display().to_string(),
            Self::Rtsp(url) | Self::Http(url) => self.without_secret(url),
        }
    }

    /// Takes the name and password of the address out of a text.
    pub fn without_secret(&self, text: &str) -> String {
        match self.secret() {
            Some(secret) => text.replace(secret, ""),
            None => text.to_owned(),
        }
    }

    /// `user:password@`.
    fn secret(&self) -> Option<&str> {
        let (Self::Rtsp(url) | Self::Http(url)) = self else { return None };
        let (_, rest) = url.split_once("://")?;
        let host = rest.split(['/', '?', '#']).next()?;
        host.rfind('@').map(|at| &host[..=at])
    }

    /// What results are named after.
    pub fn name(&self) -> String {
        let text = |name: Option<&OsStr>| name.map(|name| name.to_string_lossy().into_owned());
        let name = match self {
            Self::File(path) => text(path.file_stem()),
            Self::Camera(path) => text(path.file_name()),
            Self::Rtsp(_) | Self::Http(_) => {
                let shown = self.shown();
                let rest = shown.split_once("://").map_or("", |(_, rest)| rest);
                let path = rest.split(['?', '#']).next().unwrap_or_default();
                let last = path.rsplit('/').find(|part| !part.is_empty()).map(PathBuf::from);
                // The dots of a host are no endings.
                let ending = if path.trim_end_matches('/').contains('/') { Path::file_stem } else { Path::file_name };
                last.and_then(|last| text(ending(&last)))
            }
        };
        let plain = |c: char| if c.is_control() || r#"/\:*?"<>|"#.contains(c) { '_' } else { c };
        let name: String = name.unwrap_or_default().chars().map(plain).collect();
        if name.trim_matches('.').is_empty() { "video".to_owned() } else { name }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> Location {
        Location::of(Path::new(text)).unwrap()
    }

    #[test]
    fn what_is_opened() {
        assert_eq!(of("/dev/video0"), Location::Camera("/dev/video0".into()));
        assert!(
            matches!(of("RTSP://cam/1"), Location::Rtsp(_)) && matches!(of("https://a.b/c.mp4"), Location::Http(_))
        );
        for other in ["clip.mp4", "concat:a|b", "file:///a", "ftp://a/b", "http://", "-"] {
            assert_eq!(Location::of(Path::new(other)), None, "{other}");
        }
        let file = Location::File("concat:a|b %03d".into());
        assert_eq!(file.arguments(), ["-protocol_whitelist", "file,pipe", "-i", "file:concat:a|b %03d"]);
        let http = of("http://a/b").arguments();
        assert!(!http[1].to_str().unwrap().contains("file") && !http[1].to_str().unwrap().contains("concat"));
    }

    #[test]
    fn passwords_stay_inside() {
        let camera = of("rtsp://me:p@ss@cam.local/stream1?x=1");
        assert_eq!(camera.shown(), "rtsp://cam.local/stream1?x=1");
        assert_eq!(
            camera.without_secret("rtsp://me:p@ss@cam.local/stream1: refused"),
            "rtsp://cam.local/stream1: refused"
        );
        assert_eq!(of("http://a.b/me@home").shown(), "http://a.b/me@home");
    }

    #[test]
    fn names() {
        for (input, name) in [
            ("rtsp://me:secret@cam.local/stream1", "stream1"),
            ("rtsp://192.168.1.5:554/", "192.168.1.5_554"),
            ("http://a.b/clips/sky.mp4?x=/y.z", "sky"),
            ("/dev/video12", "video12"),
        ] {
            assert_eq!(of(input).name(), name);
        }
        for (file, name) in [("a/b c.mp4", "b c"), ("a\nb.avi", "a_b"), ("it's \"1\".mkv", "it's _1_"), ("..", "video")]
        {
            assert_eq!(Location::File(file.into()).name(), name);
        }
    }
}
