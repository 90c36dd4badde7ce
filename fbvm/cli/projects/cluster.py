"""The option --cluster, and the cluster that it names."""

from __future__ import annotations

import logging
import re
from contextlib import AbstractContextManager
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from distributed import Client

    from fbvm.campaign.cluster import Cluster

_ADDRESS = re.compile(r"local|(tcp|tls|wss?)://[^/\s]+:\d+")


def _address(context: click.Context, parameter: click.Parameter, value: str | None) -> str | None:
    """The address, if it is one: Dask waits for half a minute before it says that of another text."""
    if value is not None and not _ADDRESS.fullmatch(value):
        raise click.BadParameter(f"{value!r} is no scheduler: write local, or an address such as tcp://192.168.1.5:8786")
    return value


cluster_option = click.option(
    "--cluster", metavar="local|tcp://HOST:PORT", callback=_address,
    help="Have Dask do the work: in processes of this machine, or by the workers of a scheduler.")  # fmt: skip


def cluster_of(bench: Any, address: str, jobs: int) -> Cluster[Any, Any]:
    """The cluster at an address, for the tasks of a bench.  Raises UsageError if Dask is not installed."""
    _check_dask()
    from fbvm.campaign.cluster import Cluster

    return Cluster(bench, address, jobs)


def client_of(address: str, jobs: int) -> AbstractContextManager[Client]:
    """A client of the cluster at an address.  Raises UsageError if Dask is not installed."""
    _check_dask()
    from fbvm.campaign.cluster import connected

    return connected(address, jobs)


def _check_dask() -> None:
    if find_spec("distributed") is None:
        raise click.UsageError("--cluster needs Dask: pip install 'fbvm[cluster]'")
    import distributed  # noqa: F401 - which sets the levels of its loggers

    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)  # the verb says itself that a scheduler has gone
