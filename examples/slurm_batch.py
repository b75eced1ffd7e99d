"""Many videos on a SLURM cluster: each job is a Dask worker, each worker does a video at a time.

    pip install 'apgstmd[batch]' dask-jobqueue
    python examples/slurm_batch.py '/shared/clips/*.mp4' --out /shared/found --workers 40 --partition short

The videos and the results must lie where all nodes see them, and the environment must be the same on all. Run it on the
login node, in tmux, or as a small job of its own: it only hands out work. When it ends, or a node does, the same command
with --resume goes on with what is left.
"""

from __future__ import annotations

import argparse
import sys

import distributed
from dask_jobqueue import SLURMCluster

import apgstmd


def main() -> int:
    parser = argparse.ArgumentParser(description="apgstmd batch on the nodes of a SLURM cluster")
    parser.add_argument("paths", nargs="+", help="videos, folders of pictures, quoted patterns, @list.txt")
    parser.add_argument("--out", required=True, help="folder for all results, seen by all nodes")
    parser.add_argument("--resume", action="store_true", help="go on in a folder that was used before")
    parser.add_argument("--workers", type=int, default=4, help="SLURM jobs, each one video at a time")
    parser.add_argument("--cores", type=int, default=2, help="cores of a job, all for its video")
    parser.add_argument("--memory", default="4GB", help="memory of a job")
    parser.add_argument("--walltime", default="04:00:00", help="time of a job; a video must fit into it")
    parser.add_argument("--partition", help="SLURM partition")
    parser.add_argument("--account", help="SLURM account")
    parser.add_argument("--speed", default="auto", help="px/frame, px/s as 40px/s, or auto")
    parser.add_argument("--report", action="store_true", help="a page for each video")
    args = parser.parse_args()

    with SLURMCluster(
        queue=args.partition,
        account=args.account,
        # One process with one Dask thread, so that it takes one video at a time; the video has all cores of the job.
        processes=1,
        cores=1,
        job_cpu=args.cores,
        memory=args.memory,
        walltime=args.walltime,
    ) as cluster:
        # Unlike scale(), this asks for new jobs in place of those that end.
        cluster.adapt(minimum=1, maximum=args.workers)
        with distributed.Client(cluster) as client:
            clips = apgstmd.batch(
                args.paths,
                args.out,
                client=client,
                threads=args.cores,
                resume=args.resume,
                speed=args.speed,
                report=args.report,
            )
    failed = [clip for clip in clips if not clip.done]
    print(f"{len(clips) - len(failed)} of {len(clips)} clips are done: {args.out}/index.html")
    for clip in failed:
        print(f"{clip.name}: {clip.error}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
