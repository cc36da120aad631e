"""Protocols of cameras: pictures and motion JPEG by HTTP, streams by RTSP."""
