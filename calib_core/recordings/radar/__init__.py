"""Radar messages, whatever their layout, as scans."""
