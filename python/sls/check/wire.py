"""A wire with faults between two interfaces: `python3 wire.py A B DELAY_MS JITTER_MS [DUPLICATE_PERCENT SEED]`.

It forwards Ethernet frames in both directions, each after the delay and up to the jitter more, so that frames overtake
each other. Many kernels lack netem, which would do the same. It prints `ready`, and at SIGTERM its counts."""

import ctypes
import heapq
import select
import signal
import socket
import struct
import sys
import time
from contextlib import suppress
from random import Random

# Of <linux/if_packet.h>, <linux/if_ether.h> and <asm/socket.h>; the module `socket` has none of them.
SOL_PACKET, ADD_MEMBERSHIP, VNET_HDR, IGNORE_OUTGOING, PROMISCUOUS = 263, 1, 15, 23, 1
ETH_P_ALL = 3
SO_SNDBUFFORCE, SO_RCVBUFFORCE, BUFFER = 32, 33, 1 << 22
PR_SET_PDEATHSIG = 1
MOST_QUEUED = 20_000  # beyond it frames are lost, as in a switch
MOST_BYTES = 70_000   # of a frame that is not yet cut into packets


def open_interface(name: str) -> socket.socket:
    end = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, 0)
    member = struct.pack("iHH8s", socket.if_nametoindex(name), PROMISCUOUS, 0, b"")
    # Between veth ends checksums are incomplete; the header makes the kernel complete them.
    for option, value in ((VNET_HDR, 1), (IGNORE_OUTGOING, 1), (ADD_MEMBERSHIP, member)):
        end.setsockopt(SOL_PACKET, option, value)
    for option in (SO_SNDBUFFORCE, SO_RCVBUFFORCE):
        end.setsockopt(socket.SOL_SOCKET, option, BUFFER)
    end.bind((name, ETH_P_ALL))
    return end


def forward(ends: list[socket.socket], delay_s: float, jitter_s: float, duplicates: float, random: Random,
            counts: dict[str, int]) -> None:
    queue: list[tuple[float, int, int, bytes]] = []  # when due, number of the frame, end, frame
    newest = [0, 0]
    while True:
        left_s = max(0.0, queue[0][0] - time.monotonic()) if queue else None
        for end in select.select(ends, [], [], left_s)[0]:
            frame = end.recv(MOST_BYTES)
            counts["frames"] += 1
            copies = 1 + (random.random() < duplicates)
            counts["duplicated"] += copies - 1
            for _ in range(copies):
                if len(queue) < MOST_QUEUED:
                    due = time.monotonic() + delay_s + random.random() * jitter_s
                    heapq.heappush(queue, (due, counts["frames"], 1 - ends.index(end), frame))
                else:
                    counts["lost"] += 1
        while queue and queue[0][0] <= time.monotonic():
            _, number, to, frame = heapq.heappop(queue)
            counts["overtaken"] += number < newest[to]
            newest[to] = max(newest[to], number)
            try:
                ends[to].send(frame)
            except OSError:
                counts["lost"] += 1


def main(a: str, b: str, delay_ms: str, jitter_ms: str, duplicate_percent: str = "0", seed: str = "1") -> None:
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)  # ends with the process that started it
    counts = dict.fromkeys(("frames", "duplicated", "overtaken", "lost"), 0)
    ends = [open_interface(name) for name in (a, b)]
    print("ready", flush=True)
    with suppress(KeyboardInterrupt):
        forward(ends, float(delay_ms) / 1000, float(jitter_ms) / 1000, float(duplicate_percent) / 100,
                Random(int(seed)), counts)
    print("wire: " + ", ".join(f"{count} {what}" for what, count in counts.items()), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
