"""Computes the type hashes of common/ros from the schemas, and compares them with published ones.
type_hash_test.py MIRRORS_DUMP"""

import json
import pathlib
import subprocess
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "idl/ros"))

import type_hash  # noqa: E402

DEFINITIONS = type_hash.parse_definitions((ROOT / "idl/ros/messages.msg").read_text(encoding="utf-8"))
DUMP = None

# Hashes from the generator of ROS 2, published by other projects.
PUBLISHED = {
    # github.com/ros2/rmw_zenoh, docs/design.md
    "std_msgs/msg/String": "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
    # github.com/carla-simulator/carla, LibCarla/source/carla/ros2/types/CdrTopicInfo.h
    "rosgraph_msgs/msg/Clock": "RIHS01_692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564",
    "nav_msgs/msg/Odometry": "RIHS01_3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0",
    "tf2_msgs/msg/TFMessage": "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
    "std_msgs/msg/Header": "RIHS01_f49fb3ae2cf070f793645ff749683ac6b06203e41c891e17701b1cb597ce6a01",
    # github.com/micro-ROS/micro_ros_arduino, src/PACKAGE/msg/detail/TYPE__struct.h (made by rosidl_generator_c)
    "geometry_msgs/msg/PoseStamped": "RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8",
    "visualization_msgs/msg/MarkerArray": "RIHS01_86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf",
    # github.com/hpmicro/hpm_sdk, middleware/microros/kilted/include/…/marker__description.c (the same)
    "visualization_msgs/msg/Marker": "RIHS01_45b13ccf791f225962bf74e746f9644518855d783a6f42ba0cc14fde2b4f3ce0",
}


class TypeHashTest(unittest.TestCase):
    def test_published_hashes_come_out(self):
        definitions = dict(DEFINITIONS)
        definitions["std_msgs/msg/String"] = type_hash.parse_definition("std_msgs/msg/String", "string data\n")
        for name, published in PUBLISHED.items():
            self.assertEqual(type_hash.calc_type_hash(definitions, name), published, name)

    def test_every_channel_has_the_hash_of_its_schema(self):
        lines = subprocess.run([DUMP], check=True, stdout=subprocess.PIPE, text=True).stdout.splitlines()
        channels = [line for line in map(json.loads, lines) if "topic" in line]
        self.assertEqual(len(channels), 3 + 2 * 6)
        for channel in channels:
            name = channel["type"]
            definitions = type_hash.parse_definitions(channel["schema"], first=name)
            self.assertEqual(set(definitions), {name} | type_hash.find_nested(definitions, name))
            self.assertEqual(channel["type_hash"], type_hash.calc_type_hash(definitions, name), name)
            self.assertEqual(channel["type_hash"], PUBLISHED[name], name)

    def test_kinds_of_fields_have_the_numbers_of_field_type(self):
        fields = {"bool a": (15, 0, 0), "byte[] a": (160, 0, 0), "float32[3] a": (58, 3, 0),
                  "string<=10 a": (21, 0, 10), "string<=10[<=5] a": (117, 5, 10), "int8[<=2] a 0": (98, 2, 0),
                  "Other a": (1, 0, 0)}
        for line, (kind, capacity, string_capacity) in fields.items():
            found = type_hash.parse_field(line, "package")["type"]
            self.assertEqual((found["type_id"], found["capacity"], found["string_capacity"]),
                             (kind, capacity, string_capacity), line)
        self.assertEqual(type_hash.parse_field("Other[] a", "package")["type"]["nested_type_name"],
                         "package/msg/Other")
        self.assertIsNone(type_hash.parse_field("int32 LINE_STRIP=4", "package"))
        self.assertRaises(ValueError, type_hash.parse_field, "nonsense", "package")


if __name__ == "__main__":
    DUMP = sys.argv.pop(1)
    unittest.main()
