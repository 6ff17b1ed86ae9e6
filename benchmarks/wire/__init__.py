"""Devices on the wire: emulated devices behind real client libraries, sockets and terminals."""
