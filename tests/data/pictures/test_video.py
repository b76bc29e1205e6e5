import os
import re
import struct
from pathlib import Path

import av
import numpy as np
import pytest
from av.stream import Disposition

from dreamdrive.data.clip_reader import read_clip
from dreamdrive.data.frames.select import UNBOUNDED
from dreamdrive.data.pictures import video
from dreamdrive.data.pictures.video import Video
from dreamdrive.errors import InputError
from tests.data.textures import approach, write_video

ALL = range(0, UNBOUNDED)


def brightness(frame) -> float:
    """What ``make_video`` made of the index."""
    return (float(frame.rgb[:, -10:].mean()) - 40) / 3


def test_frames_come_in_order_with_their_times(make_video):
    video = Video.open(make_video(12, rate=20))
    frames = list(video.read(ALL))
    assert [f.index for f in frames] == list(range(12))
    np.testing.assert_allclose([f.time_s for f in frames], np.arange(12) / 20, atol=1e-6)
    np.testing.assert_allclose([brightness(f) for f in frames], np.arange(12), atol=0.5)
    assert video.count() == 12
    assert video.rate_hz == 20


def test_only_the_wanted_frames_are_read(make_video):
    frames = list(Video.open(make_video(12)).read(range(3, 11, 3)))
    np.testing.assert_allclose([brightness(f) for f in frames], [3, 6, 9], atol=0.5)
    assert [f.time_s for f in frames] == pytest.approx([0.15, 0.3, 0.45])


def test_decoding_stops_behind_the_last_wanted_frame(make_video):
    """The damage behind it does not matter."""
    path = make_video(60, movflags="faststart")
    path.write_bytes(path.read_bytes()[: int(path.stat().st_size * 0.7)])
    assert len(list(Video.open(path).read(range(0, 10, 2)))) == 5


@pytest.mark.parametrize("wanted", [range(0, 60, 2), ALL])
def test_a_video_cut_short_says_how_far_it_goes(make_video, wanted):
    path = make_video(60, movflags="faststart")
    path.write_bytes(path.read_bytes()[: int(path.stat().st_size * 0.7)])
    with pytest.raises(InputError, match=r"only \d+ frames could be read") as caught:
        list(Video.open(path).read(wanted))
    assert ("frame 58 is asked for" in str(caught.value)) == (wanted is not ALL)


@pytest.mark.parametrize("wanted", [range(8, 20, 2), range(15, UNBOUNDED)])
def test_asking_beyond_the_end_is_refused(make_video, wanted):
    with pytest.raises(InputError, match=r"asks for frame (18|15), but .* has only 12 frames"):
        list(Video.open(make_video(12)).read(wanted))


def test_a_video_without_its_index_is_refused(make_video):
    path = make_video(12)
    path.write_bytes(path.read_bytes()[:1500])
    with pytest.raises(InputError, match="not a readable video"):
        Video.open(path)


def test_an_empty_file_is_refused(tmp_path):
    (tmp_path / "a.mp4").touch()
    with pytest.raises(InputError, match=r"a.mp4 is empty; expected a video"):
        Video.open(tmp_path / "a.mp4")


@pytest.mark.parametrize("name", ["a.mp4", "a.txt", "a"])
def test_text_is_no_video(tmp_path, name):
    (tmp_path / name).write_text("This is not a video.\n" * 200)
    with pytest.raises(InputError, match=r"not a readable video|is not a video"):
        Video.open(tmp_path / name)


def test_sound_alone_is_refused(tmp_path):
    path = tmp_path / "a.wav"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("pcm_s16le", rate=8000)
        sound = av.AudioFrame.from_ndarray(np.zeros((1, 800), np.int16), format="s16", layout="mono")
        sound.rate = 8000
        container.mux(stream.encode(sound))
    with pytest.raises(InputError, match="no picture track"):
        Video.open(path)


@pytest.mark.parametrize(
    ("matrix", "quarters"), [((0, 1, -1, 0), -1), ((0, -1, 1, 0), 1), ((-1, 0, 0, -1), 2)]
)
def test_a_phone_held_upright_gives_upright_frames(make_video, matrix, quarters):
    path = make_video(3)
    plain = next(Video.open(path).read(ALL)).rgb
    data = bytearray(path.read_bytes())
    at = data.index(b"tkhd") + 4 + 40  # the 3x3 matrix: a b u, c d v, x y w
    for place, value in zip((0, 4, 12, 16), matrix, strict=True):
        data[at + place : at + place + 4] = (value * 65536).to_bytes(4, "big", signed=True)
    path.write_bytes(data)
    frame = next(Video.open(path).read(ALL))
    np.testing.assert_array_equal(frame.rgb, np.rot90(plain, quarters))
    assert "upright" in frame.notes[0]


def test_a_file_is_opened_and_decoded_once(make_video, monkeypatch):
    found, opened, open_it = Video.open(make_video(12)), [], video._opened
    monkeypatch.setattr(video, "_opened", lambda path: opened.append(path) or open_it(path))
    assert [frame.index for frame in found.read(ALL)] == list(range(12))
    assert opened == [found.path]


def test_damage_among_the_first_frames_is_met_where_it_lies():
    three = [av.VideoFrame(16, 16, "rgb24") for _ in range(3)]

    def decoded():
        yield from three
        raise av.error.InvalidDataError(1, "Invalid data")

    first, frames = video._looked_at(decoded())
    assert first == three == [next(frames) for _ in range(3)]
    with pytest.raises(av.error.InvalidDataError):
        next(frames)


def test_frames_that_the_decoder_patched_up_are_marked_up_to_the_next_key_frame(tmp_path):
    path = tmp_path / "a.mp4"
    with av.open(str(path), "w") as container:
        options = {"g": "10", "bf": "0", "crf": "20", "sc_threshold": "0", "preset": "veryfast"}
        stream = container.add_stream("libx264", rate=20, options=options)
        stream.width, stream.height, stream.pix_fmt = 160, 96, "yuv420p"
        for picture in approach(count=30):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode())
    assert not any(frame.damaged for frame in Video.open(path).read(ALL))
    with av.open(str(path)) as container:
        places = [(packet.pos, packet.size) for packet in container.demux(video=0) if packet.size]
    data = bytearray(path.read_bytes())
    start, size = places[13]
    rubbish = np.random.default_rng(0).integers(0, 256, size // 2, dtype=np.uint8).tobytes()
    data[start + size // 4 : start + size // 4 + len(rubbish)] = rubbish
    path.write_bytes(data)
    assert [frame.index for frame in Video.open(path).read(ALL) if frame.damaged] == list(range(13, 20))
    said = (
        "Frames 13 to 19 of the video are damaged, or built upon damaged ones, and patched up by the decoder."
    )
    assert said in read_clip(path).provenance["notes"]
    assert said.replace("13 to 19", "14, 16 and 18") in read_clip(path, frames="0:30:2").provenance["notes"]


def test_golden_a_real_video_has_the_frames_its_notes_say(data_dir):
    assert Video.open(data_dir / "clips/udacity_highway_two_cars/video.mp4").count() == 160


LISTS = {
    "hls": "#EXTM3U\n#EXT-X-TARGETDURATION:10\n#EXTINF:1,\nfile://{clip}\n#EXT-X-ENDLIST\n",
    "concat": "ffconcat version 1.0\nfile {clip}\n",
    "sdp": "v=0\no=- 0 0 IN IP4 127.0.0.1\ns=x\nc=IN IP4 127.0.0.1\nt=0 0\nm=video 5004 RTP/AVP 96\n",
    "dash": '<?xml version="1.0"?><MPD xmlns="urn:mpeg:dash:schema:mpd:2011"><BaseURL>{clip}</BaseURL></MPD>',
}


@pytest.mark.parametrize("kind", LISTS)
@pytest.mark.parametrize("name", ["list.m3u8", "list.mp4"])
def test_a_list_of_other_files_is_no_video(make_video, tmp_path, kind, name):
    (tmp_path / name).write_text(LISTS[kind].format(clip=make_video(3)))
    with pytest.raises(InputError) as caught:
        Video.open(tmp_path / name)
    said = re.sub(r"\(Invalid .*?\)", "(INVALID)", str(caught.value))
    assert said == (
        f"{tmp_path / name} is not a readable video (INVALID): it is cut short, damaged or of another kind; "
        "expected a video such as MP4, or a folder of images"
    )


def test_a_name_is_never_an_address(make_video, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    make_video(3).rename(tmp_path / "concat:a|b.mp4")
    assert Video.open(Path("concat:a|b.mp4")).count() == 3


def test_a_pipe_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "a.mp4")
    with pytest.raises(InputError) as caught:
        Video.open(tmp_path / "a.mp4")
    assert str(caught.value) == f"{tmp_path}/a.mp4 cannot be read: it is not a regular file"


def test_frames_of_a_huge_size_are_refused(make_video, monkeypatch):
    path = make_video(3)
    monkeypatch.setattr(video, "MAX_PIXELS", 3000)
    with pytest.raises(InputError) as caught:
        Video.open(path)
    assert str(caught.value) == (
        f"{path} has frames of 64x48 pixels; expected at most 0 megapixels: scale it down"
    )


def test_the_decoder_too_refuses_a_huge_size(make_video, monkeypatch):
    """A stream may say other than its container."""
    path = make_video(3)
    monkeypatch.setitem(video._CODEC, "max_pixels", "3000")
    with pytest.raises(InputError, match=r"cut short or damaged: only 0 frames could be read"):
        Video.open(path).count()


def test_more_samples_than_bytes_are_refused(make_video):
    path = make_video(3)
    data = bytearray(path.read_bytes())
    at = data.index(b"stsz") + 8
    data[at : at + 8] = struct.pack(">II", 1, 20_000_000)
    path.write_bytes(data)
    with pytest.raises(InputError) as caught:
        Video.open(path)
    assert str(caught.value) == (
        f"{path} is not a readable video: it claims 20000000 samples, more than its {len(data)} bytes can "
        "hold; copy it again"
    )


def test_more_samples_than_bytes_in_a_fragment_are_refused(make_video):
    path = make_video(3, movflags="frag_keyframe+empty_moov")
    assert Video.open(path).count() == 3
    data = bytearray(path.read_bytes())
    at = data.index(b"trun") + 4
    data[at : at + 8] = struct.pack(">II", 1, 20_000_000)
    path.write_bytes(data)
    with pytest.raises(InputError, match="claims 20000000 samples"):
        Video.open(path)


def test_metadata_of_another_encoding_does_not_matter(make_video):
    path = make_video(3)
    data = path.read_bytes()
    assert b"Lavf" in data
    path.write_bytes(data.replace(b"Lavf", b"La\xff\xfe"))
    assert Video.open(path).count() == 3


def test_a_rate_beyond_all_cameras_is_none(make_video):
    assert Video.open(make_video(3, rate=1_000_000)).rate_hz is None


def test_a_cover_is_no_video(tmp_path):
    path = tmp_path / "a.m4a"
    with av.open(str(path), "w", format="mp4") as container:
        sound = container.add_stream("aac", rate=44100)
        cover = container.add_stream("mjpeg", rate=1)
        cover.width, cover.height, cover.pix_fmt = 64, 48, "yuvj420p"
        cover.disposition = Disposition.attached_pic
        samples = av.AudioFrame.from_ndarray(np.zeros((1, 4096), np.float32), format="fltp", layout="mono")
        samples.rate = 44100
        container.mux(
            cover.encode(av.VideoFrame.from_ndarray(np.zeros((48, 64, 3), np.uint8), format="rgb24"))
        )
        container.mux(sound.encode(samples))
        container.mux(cover.encode())
        container.mux(sound.encode())
    with pytest.raises(InputError, match="holds no picture track"):
        Video.open(path)


def test_pictures_of_an_unknown_kind_are_refused(make_video):
    path = make_video(3)
    path.write_bytes(path.read_bytes().replace(b"avc1", b"xyz9"))
    with pytest.raises(InputError) as caught:
        Video.open(path)
    assert str(caught.value) == (
        f"{path} holds pictures of a kind that cannot be decoded; expected H.264 or the like"
    )


@pytest.mark.parametrize(("codec", "kind", "rate_hz"), [("libx264", "h264", 30), ("libsvtav1", "obu", None)])
def test_a_bare_track_has_the_rate_it_says_and_no_other(tmp_path, codec, kind, rate_hz):
    path = tmp_path / "a"
    pictures = [np.ascontiguousarray(picture[:48, :64]) for picture in approach(count=4)]
    write_video(path, pictures, codec=codec, rate=30, kind=kind)
    assert Video.open(path).rate_hz == rate_hz
    if rate_hz is None:
        with pytest.raises(InputError, match="give its rate with --fps"):
            read_clip(path)
    else:
        assert read_clip(path).times_s[1] == pytest.approx(1 / rate_hz)


def test_of_several_tracks_the_first_is_read_and_that_is_said(tmp_path):
    path = tmp_path / "a.mp4"
    with av.open(str(path), "w") as container:
        streams = [container.add_stream("libx264", rate=10) for _ in range(2)]
        for stream, size in zip(streams, ((64, 48), (128, 96)), strict=True):
            stream.width, stream.height, stream.pix_fmt = *size, "yuv420p"
        for stream in streams:
            for _ in range(3):
                picture = np.full((stream.height, stream.width, 3), 90, np.uint8)
                container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
            container.mux(stream.encode())
    frame = next(Video.open(path).read(ALL))
    assert frame.size == (64, 48)
    assert frame.notes[-1] == "The file has 2 tracks of pictures: the first is read."
