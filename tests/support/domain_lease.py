"""DDS domains for tests, as tests/support/domain_lease.cpp leases them."""

import os
import pathlib
import socket

FIRST, COUNT = 20, 200
FIRST_PORT, PORTS_OF_DOMAIN = 7400, 250  # RTPS 2.2, section 9.6.1.1


def sockets_in(domain: int) -> set[str]:
    """The inodes of the sockets that are bound to ports of a domain."""
    first = FIRST_PORT + PORTS_OF_DOMAIN * domain
    found: set[str] = set()
    for table in ("udp", "udp6"):
        for line in pathlib.Path("/proc/net", table).read_text(encoding="ascii").splitlines()[1:]:
            columns = line.split()
            if first <= int(columns[1].rsplit(":", 1)[1], 16) < first + PORTS_OF_DOMAIN:
                found.add(columns[9])
    return found


def holders(sockets: set[str]) -> str:
    """Names the processes that have one of these sockets."""
    names = []
    for process in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            if any(os.readlink(file)[8:-1] in sockets for file in (process / "fd").iterdir()):
                names.append(f"process {process.name} ({(process / 'comm').read_text(encoding='utf-8').strip()})")
        except OSError:
            continue
    return ", ".join(names) or "a process that is not visible"


def lease_domain(first: int = FIRST, count: int = COUNT) -> tuple[int, socket.socket]:
    """@return a domain that no test uses and nobody else, and the socket that claims it until it is closed"""
    taken = ""
    for i in range(count):
        domain = first + (os.getpid() * 7 + i) % count
        claim = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        try:
            claim.bind(f"\0tfdude-test-domain-{domain}")
        except OSError:
            claim.close()
            continue
        sockets = sockets_in(domain)
        if not sockets:
            return domain, claim
        claim.close()
        if len(taken) < 1000:
            taken += f"\ndomain {domain} has sockets of {holders(sockets)}"
    raise RuntimeError("all DDS domains for tests are taken" + taken)
