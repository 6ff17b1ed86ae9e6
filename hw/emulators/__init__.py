"""Devices that are not there, on real sockets and terminals: what client libraries are proven against."""
