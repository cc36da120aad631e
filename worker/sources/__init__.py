"""What cameras speak: pictures by HTTP, endless ones too, and streams by RTSP."""
