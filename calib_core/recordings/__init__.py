"""Read recordings: ROS 1 and ROS 2 files in; radar scans, images and intrinsics out. No other package knows containers."""

from calib_core.recordings.camera.images import EncodedImage
from calib_core.recordings.containers.opening import begins_recording, holds_recording
from calib_core.recordings.containers.sources import assumption_hint, assumption_warnings
from calib_core.recordings.following import AwaitedRecording, FollowedRecording, Growth
from calib_core.recordings.frame_transforms import FrameTransform, frame_transforms
from calib_core.recordings.plain_files.folder_cameras import size_of_images_beside
from calib_core.recordings.recording import (
    Recording,
    first_image,
    inspect_recording,
    open_recording,
    require_files,
)
from calib_core.recordings.selection import RecordingOptions, figures_text
from calib_core.recordings.summary import RecordingSummary, clock_lines, describe, recording_summary, table_lines
from calib_core.recordings.time.clock_diagnosis import ClockDiagnosis
from calib_core.recordings.topics import TopicSummary
from calib_core.recordings.verification import Verification, verification_text, verify_recording
from calib_core.recordings.video_writing import SkippedFrames, WrittenVideo, video_format, write_video

__all__ = [
    "AwaitedRecording",
    "ClockDiagnosis",
    "EncodedImage",
    "FollowedRecording",
    "FrameTransform",
    "Growth",
    "Recording",
    "RecordingOptions",
    "RecordingSummary",
    "SkippedFrames",
    "TopicSummary",
    "Verification",
    "WrittenVideo",
    "assumption_hint",
    "assumption_warnings",
    "begins_recording",
    "clock_lines",
    "describe",
    "figures_text",
    "first_image",
    "frame_transforms",
    "holds_recording",
    "inspect_recording",
    "open_recording",
    "recording_summary",
    "require_files",
    "size_of_images_beside",
    "table_lines",
    "verification_text",
    "verify_recording",
    "video_format",
    "write_video",
]
