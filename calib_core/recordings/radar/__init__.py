"""Read radar messages of any supported layout as scans."""
