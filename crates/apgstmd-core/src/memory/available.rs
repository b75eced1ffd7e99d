//! What memory there is for this process, as far as Linux tells: of the machine, and of the control groups that containers and
//! services are, which end a process that takes more.

use std::fs::read_to_string;
use std::path::{Path, PathBuf};

use procfs::process::{MountInfo, Process};
use procfs::{Current, Meminfo, ProcessCGroup};

/// Bytes that can still be had.
pub(super) fn available() -> Option<u64> {
    groups().unwrap_or_default().iter().filter_map(Group::left).chain(machine()).min()
}

fn machine() -> Option<u64> {
    let info = Meminfo::current().ok()?;
    Some(info.mem_available? + info.swap_free)
}

/// A group that the process is in, and the groups around it.
struct Group {
    place: PathBuf,
    /// Folder of the outermost that is seen from here.
    outermost: PathBuf,
    files: &'static Files,
}

struct Files {
    limit: &'static str,
    /// Key in `memory.stat` of what is held and is no copy of a file.
    held: &'static str,
}

const VERSION_1: Files = Files { limit: "memory.limit_in_bytes", held: "total_rss" };
const VERSION_2: Files = Files { limit: "memory.max", held: "anon" };

fn groups() -> Option<Vec<Group>> {
    let process = Process::myself().ok()?;
    let (groups, mounts) = (process.cgroups().ok()?, process.mountinfo().ok()?);
    Some(groups.into_iter().filter_map(|group| mounts.0.iter().find_map(|mount| Group::seen(&group, mount))).collect())
}

impl Group {
    /// Where a group that limits memory lies below a mount.
    fn seen(group: &ProcessCGroup, mount: &MountInfo) -> Option<Self> {
        let files = match mount.fs_type.as_str() {
            "cgroup2" if group.hierarchy == 0 => &VERSION_2,
            "cgroup" if group.controllers.iter().any(|name| name == "memory") => &VERSION_1,
            _ => return None,
        };
        if group.hierarchy != 0 && !mount.super_options.contains_key("memory") {
            return None;
        }
        let below = Path::new(&group.pathname).strip_prefix(&mount.root).ok()?;
        Some(Self { place: mount.mount_point.join(below), outermost: mount.mount_point.clone(), files })
    }

    /// The least that it or one around it has left. Copies of files that the group keeps are given back when they are in the way.
    fn left(&self) -> Option<u64> {
        let inside = self.place.ancestors().take_while(|place| place.starts_with(&self.outermost));
        inside.filter_map(|place| self.left_of(place)).min()
    }

    fn left_of(&self, place: &Path) -> Option<u64> {
        // Without a limit it says "max".
        let limit: u64 = read_to_string(place.join(self.files.limit)).ok()?.trim().parse().ok()?;
        let stat = read_to_string(place.join("memory.stat")).ok()?;
        let held = stat.lines().find_map(|line| line.strip_prefix(self.files.held)?.strip_prefix(' '));
        Some(limit.saturating_sub(held?.trim().parse().ok()?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn mount(line: &str) -> MountInfo {
        MountInfo::from_line(line).unwrap()
    }

    fn group(hierarchy: u32, controllers: &[&str], pathname: &str) -> ProcessCGroup {
        let controllers = controllers.iter().map(|name| (*name).to_owned()).collect();
        ProcessCGroup { hierarchy, controllers, pathname: pathname.to_owned() }
    }

    #[test]
    fn groups_lie_below_their_mounts() {
        let second = mount("30 23 0:26 / /sys/fs/cgroup rw,nosuid - cgroup2 cgroup2 rw,nsdelegate");
        let of_memory = mount("35 31 0:30 /docker/12 /sys/fs/cgroup/memory rw - cgroup cgroup rw,memory");
        let of_cpu = mount("36 31 0:31 / /sys/fs/cgroup/cpu rw - cgroup cgroup rw,cpu");
        let disk = mount("25 0 254:1 / / rw,relatime - ext4 /dev/vda rw");
        let seen = |group: &ProcessCGroup, mount: &MountInfo| Group::seen(group, mount).map(|group| group.place);

        let service = group(0, &[], "/system.slice/camera.service");
        let place = Path::new("/sys/fs/cgroup/system.slice/camera.service");
        assert_eq!(seen(&service, &second).as_deref(), Some(place));
        let first = group(9, &["memory"], "/docker/12/inner");
        assert_eq!(seen(&first, &of_memory).as_deref(), Some(Path::new("/sys/fs/cgroup/memory/inner")));
        // Of another container, of another kind, no group at all.
        assert_eq!(seen(&group(9, &["memory"], "/docker/34"), &of_memory), None);
        for other in [&of_cpu, &second, &disk] {
            assert_eq!(seen(&first, other), None);
        }
        for other in [&of_memory, &of_cpu, &disk] {
            assert_eq!(seen(&service, other), None);
        }
    }

    #[test]
    fn the_tightest_group_counts() {
        let outermost = std::env::temp_dir().join(format!("apgstmd-groups-{}", std::process::id()));
        let place = outermost.join("outer/inner");
        fs::create_dir_all(&place).unwrap();
        let write = |place: &Path, limit: &str, stat: &str| {
            fs::write(place.join("memory.max"), limit).unwrap();
            fs::write(place.join("memory.stat"), stat).unwrap();
        };
        let group = Group { place: place.clone(), outermost: outermost.clone(), files: &VERSION_2 };
        assert_eq!(group.left(), None);
        write(&place, "max\n", "anon 5000\nfile 70\n");
        assert_eq!(group.left(), None);
        write(&outermost.join("outer"), "9000\n", "file 4000\nanon_thp 3\nanon 7000\n");
        assert_eq!(group.left(), Some(2000));
        write(&place, "6000\n", "anon 5000\nfile 70\n");
        assert_eq!(group.left(), Some(1000));
        // It is full, and the limit was lowered since.
        write(&place, "4000\n", "anon 5000\nfile 70\n");
        assert_eq!(group.left(), Some(0));
        fs::remove_dir_all(outermost).unwrap();
    }

    #[test]
    fn a_machine_has_some() {
        let total = Meminfo::current().unwrap();
        let there = available().unwrap();
        assert!(there > 1 << 20 && there <= total.mem_total + total.swap_total, "{there}");
    }
}
