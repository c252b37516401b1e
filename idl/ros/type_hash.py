#!/usr/bin/env python3
"""RIHS01 type hashes of ROS 2 messages from their ros2msg text (REP-2016): of the definitions in messages.msg, or of
those in the file that is given. Prints `package/msg/Type RIHS01_…`, sorted."""

import argparse
import hashlib
import json
import pathlib
import re

SEPARATOR = "=" * 80

# type_description_interfaces/msg/FieldType. Arrays of a fixed length, bounded and unbounded sequences have numbers that
# are 48, 96 and 144 higher.
NESTED = 1
FIELD_TYPES = {"int8": 2, "uint8": 3, "int16": 4, "uint16": 5, "int32": 6, "uint32": 7, "int64": 8, "uint64": 9,
               "float32": 10, "float64": 11, "char": 13, "wchar": 14, "bool": 15, "byte": 16, "string": 17,
               "wstring": 18}
BOUNDED_STRING = {"string": 21, "wstring": 22}
ARRAY, BOUNDED_SEQUENCE, UNBOUNDED_SEQUENCE = 48, 96, 144

FIELD = re.compile(r"(?P<base>[\w/]+)(?:<=(?P<string_bound>\d+))?(?:\[(?P<at_most><=)?(?P<length>\d*)\](?P<array>))?"
                   r"\s+(?P<name>[a-z]\w*)")


def full_name(name, package):
    """geometry_msgs/msg/Point for geometry_msgs/Point, and for Point in `package`."""
    parts = name.split("/")
    return f"{parts[0] if len(parts) > 1 else package}/msg/{parts[-1]}"


def parse_field(line, package):
    """The JSON of one field; nothing for a constant. Raises ValueError if the line is neither."""
    match = FIELD.match(line)
    if not match:
        if re.match(r"[\w<=]+\s+[A-Z][A-Z0-9_]*\s*=", line):
            return None
        raise ValueError(f"expected a field or a constant, got '{line}'")
    base, bound = match["base"], int(match["string_bound"] or 0)
    kind = NESTED if base not in FIELD_TYPES else BOUNDED_STRING[base] if bound else FIELD_TYPES[base]
    if match["array"] is not None:
        kind += BOUNDED_SEQUENCE if match["at_most"] else ARRAY if match["length"] else UNBOUNDED_SEQUENCE
    return {"name": match["name"],
            "type": {"type_id": kind, "capacity": int(match["length"] or 0), "string_capacity": bound,
                     "nested_type_name": "" if base in FIELD_TYPES else full_name(base, package)}}


def parse_definition(name, text):
    """The IndividualTypeDescription of `name`, without default values, which do not count in a hash."""
    lines = (line.split("#")[0].strip() for line in text.splitlines())
    fields = [parse_field(line, name.split("/")[0]) for line in lines if line]
    return {"type_name": name, "fields": [field for field in fields if field]}


def parse_definitions(text, first=""):
    """All definitions of a ros2msg text by full name; `first`: name of the one before the first separator."""
    definitions = {}
    for part in re.split(f"^{SEPARATOR}\n", text, flags=re.MULTILINE):
        name = first
        if part.startswith("MSG: "):
            head, _, part = part.partition("\n")
            name = full_name(head[len("MSG: "):].strip(), "")
        if name:
            definitions[name] = parse_definition(name, part)
    return definitions


def find_nested(definitions, name):
    """Names of all types inside `name`, at every level."""
    found = set()
    waiting = [name]
    while waiting:
        for field in definitions[waiting.pop()]["fields"]:
            nested = field["type"]["nested_type_name"]
            if nested and nested not in found:
                found.add(nested)
                waiting.append(nested)
    return found


def calc_type_hash(definitions, name):
    """"RIHS01_" and the SHA-256 of the TypeDescription as JSON."""
    description = {"type_description": definitions[name],
                   "referenced_type_descriptions": [definitions[nested] for nested in
                                                    sorted(find_nested(definitions, name))]}
    text = json.dumps(description, ensure_ascii=True, separators=(", ", ": "))
    return "RIHS01_" + hashlib.sha256(text.encode()).hexdigest()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", nargs="?", type=pathlib.Path,
                        default=pathlib.Path(__file__).resolve().parent / "messages.msg")
    definitions = parse_definitions(parser.parse_args().file.read_text(encoding="utf-8"))
    for name in sorted(definitions):
        print(name, calc_type_hash(definitions, name))


if __name__ == "__main__":
    main()
