"""The option --cluster, and the cluster that it names."""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from fbvm.campaign.cluster import Cluster

cluster_option = click.option(
    "--cluster", metavar="local|tcp://HOST:PORT",
    help="Have Dask do the work: in processes of this machine, or by the workers of a scheduler.")  # fmt: skip


def cluster_of(bench: Any, address: str, jobs: int) -> Cluster[Any, Any]:
    """The cluster at an address, for the tasks of a bench.  Raises UsageError if Dask is not installed."""
    if find_spec("distributed") is None:
        raise click.UsageError("--cluster needs Dask: pip install 'fbvm[cluster]'")
    from fbvm.campaign.cluster import Cluster

    return Cluster(bench, address, jobs)
