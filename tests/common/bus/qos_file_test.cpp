// A QoS file is checked before the middleware reads it, and every error message names a place.
#include "common/bus/qos_file.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <tinyxml2.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <iostream>
#include <map>
#include <vector>

#include "common/bus/node.hpp"
#include "common/config/config_error.hpp"
#include "fastdds_files.hpp"
#include "tests/support/edited_documents.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/own_domain.hpp"
#include "tests/support/temporary_folder.hpp"

namespace sls::bus {
namespace {

namespace fs = std::filesystem;

const fs::path kConfig = fs::path(SLS_SOURCE_DIR) / "config";

/// The message of the ConfigError that checking `file` gives, or "no error".
std::string find_error(const fs::path& file) {
  return sls::test::find_error<config::ConfigError>([&] { read_qos_file(file, "tester"); });
}

class QosFileTest : public testing::Test {
 protected:
  std::string find_error_in(const std::string& text) {
    test::write_bytes(folder_ / "qos.xml", text);
    const std::string error = find_error(folder_ / "qos.xml");
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
    const std::string place = (folder_ / "qos.xml").string();
    return error.rfind(place, 0) == 0 ? error.substr(place.size()) : error;
  }

  const sls::test::TemporaryFolder folder_;
};

TEST_F(QosFileTest, TheShippedFilesPass) {
  ::setenv("SLS_KEYS", "keys", 1);  // secure.xml needs it
  int count = 0;
  for (const auto& entry : fs::directory_iterator(kConfig / "qos")) {
    if (entry.path().extension() != ".xml" || entry.path().stem() == "endpoints") continue;
    EXPECT_EQ(find_error(entry.path()), "no error") << entry.path();
    ++count;
  }
  EXPECT_GE(count, 5);
}

TEST_F(QosFileTest, AMissingFileIsNamed) {
  EXPECT_EQ(find_error(folder_ / "nothing.xml"),
            (folder_ / "nothing.xml").string() +
                ": expected a QoS file, got none (No such file or directory)");
  EXPECT_NE(find_error(""), "no error");
}

TEST_F(QosFileTest, ADirectoryIsNamed) {
  EXPECT_EQ(find_error(folder_.path()),
            folder_.path().string() + ": expected a QoS file, got a directory");
}

TEST_F(QosFileTest, AnEmptyFileIsNamed) {
  const std::string error = find_error_in("");
  EXPECT_NE(error.find("empty"), std::string::npos) << error;
}

TEST_F(QosFileTest, AHundredMegabytesAreRefusedUnread) {
  test::write_bytes(folder_ / "qos.xml", "<dds>");
  fs::resize_file(folder_ / "qos.xml", 100'000'000);
  const std::string error = find_error(folder_ / "qos.xml");
  EXPECT_NE(error.find("100000000"), std::string::npos) << error;
}

TEST_F(QosFileTest, APipeOrDeviceIsRefusedUnread) {
  ASSERT_EQ(::mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  for (const fs::path& file : {folder_ / "pipe", fs::path("/dev/zero")}) {
    const std::string error = find_error(file);
    EXPECT_EQ(error.rfind(file.string() + ": expected a QoS file, got ", 0), 0u) << error;
  }
}

TEST_F(QosFileTest, AnUnreadableFileIsNamedWithTheCause) {
  sls::test::write_bytes(folder_ / "qos.xml", "<dds/>");
  fs::permissions(folder_.path(), fs::perms(0755));
  fs::permissions(folder_ / "qos.xml", fs::perms::none);
  EXPECT_EXIT(
      {
        if (::geteuid() == 0 && ::setuid(65534) != 0) ::_exit(1);  // user nobody
        std::cerr << find_error(folder_ / "qos.xml") << std::endl;
        ::_exit(2);  // skips exit handlers: the parent's threads do not exist here
      },
      testing::ExitedWithCode(2),
      "qos.xml: expected a QoS file, got none that can be read .Permission denied.");
}

TEST_F(QosFileTest, TheDefaultOfThisBuildPasses) {
  EXPECT_EQ(find_error(default_qos_file()), "no error") << default_qos_file();
  setenv("SLS_CONFIG", "/opt/sls/config", 1);
  EXPECT_EQ(default_qos_file(), "/opt/sls/config/qos/default.xml");
  unsetenv("SLS_CONFIG");
  EXPECT_NE(default_qos_file(), "/opt/sls/config/qos/default.xml");
}

TEST_F(QosFileTest, AFileWithoutElementsLacksTheFirstProfile) {
  const std::string error = find_error_in("<?xml version=\"1.0\"?>\n<dds/>\n");
  EXPECT_EQ(error.rfind(": profile 'sls_participant': expected a <participant> of this name", 0),
            0u)
      << error;
}

TEST_F(QosFileTest, NotXmlAtAllIsMalformed) {
  for (const char* text :
       {"name: figure_eight\n", "\x7f\x45\x4c\x46", "   \n\n", "<!-- only this -->"})
    EXPECT_NE(find_error_in(text), "no error") << text;
}

TEST_F(QosFileTest, AbsurdNestingIsMalformedAndNoStackOverflow) {
  std::string text;
  for (int i = 0; i < 100000; ++i) text += "<a>";
  EXPECT_NE(find_error_in(text).find("expected well-formed XML"), std::string::npos);
}

TEST_F(QosFileTest, EachMisspeltProfileOfOursIsNamed) {
  const std::string participant = "<participant profile_name=\"sls_participant\"/>";
  for (const char* element : {"data_writer", "data_reader", "participant"}) {
    const std::string error = find_error_in("<dds><profiles>\n" + participant + "<" + element +
                                            " profile_name=\"sls_misspelt\"/></profiles></dds>");
    EXPECT_EQ(error.rfind(":2: profile 'sls_misspelt': expected one that", 0), 0u) << error;
  }
}

// --- invalid_qos_files.txt: one row per defect

/// Uses `file` as a program does and ends the process; prints the message and exits with 2 if the
/// file is refused.
[[noreturn]] void use_file_and_exit(const fs::path& file) {
  int code = 0;
  try {
    Node node(file, test::own_domain(), "test_bus");
    Writer<States> loop_writer(node);
    Writer<RecordBatch> record_writer(node);
    Writer<Parameters> latched_writer(node);
    Reader<States> loop_reader(node, kLoopReaderProfile, [](const auto&, const PeerId&) {});
    Reader<RecordBatch> record_reader(node, kRecordReaderProfile,
                                      [](const auto&, const PeerId&) {});
    Reader<Parameters> latched_reader(node, kLatchedReaderProfile,
                                      [](const auto&, const PeerId&) {});
  } catch (const config::ConfigError& error) {
    std::cerr << error.what() << std::endl;
    code = 2;
  }
  std::exit(code);
}

/// `text` as a regular expression of GoogleTest that matches it literally.
std::string quote(const std::string& text) {
  std::string quoted;
  for (const char letter : text) {
    if (std::string("\\^$.[]|()*+?{}").find(letter) != std::string::npos) quoted += '\\';
    quoted += letter;
  }
  return quoted;
}

using InvalidQosFilesDeathTest = QosFileTest;

TEST_F(InvalidQosFilesDeathTest, EachRowGivesItsMessage) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");  // profiles are global to a process
  const auto files =
      sls::test::read_edited_documents(SLS_SOURCE_DIR "/tests/common/bus/invalid_qos_files.txt");
  EXPECT_GE(files.size(), 18u);
  for (const auto& [place, text, message] : files) {
    std::string expected = message;
    if (const auto at = expected.find("VERSION"); at != std::string::npos)
      expected.replace(at, 7, middleware_version());
    const std::string error = find_error_in(text);
    if (error != "no error")
      EXPECT_EQ(error, expected) << place;
    else  // only Fast DDS reports the error; the file is in another folder when the test runs again
      EXPECT_EXIT(use_file_and_exit(folder_ / "qos.xml"), testing::ExitedWithCode(2),
                  quote("/qos.xml" + expected))
          << place;
  }
}

TEST(ShippedQosFilesDeathTest, TheMiddlewareTakesEachShippedFile) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  for (const char* name : {"default", "discovery_server", "lan", "udp", "unicast", "wifi"})
    EXPECT_EXIT(use_file_and_exit(kConfig / "qos" / (std::string(name) + ".xml")),
                testing::ExitedWithCode(0), "")
        << name;
}

class QosKeysTest : public QosFileTest {
 protected:
  /// Writes a QoS file with these elements in the participant, and these profiles besides.
  fs::path make_file(const std::string& elements, const std::string& profiles) const {
    const fs::path file = folder_ / "qos.xml";
    test::write_bytes(
        file, "<dds>\n<profiles>\n<participant profile_name='sls_participant'>\n<rtps>\n" +
                  elements + "\n</rtps></participant>\n" + profiles + "</profiles></dds>\n");
    return file;
  }
};
using QosKeysDeathTest = QosKeysTest;

/// Each key has another name in Fast DDS 2 than in Fast DDS 3.
TEST_F(QosKeysDeathTest, KeysWithTheNamesOfEitherVersionAreTaken) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  using Keys = std::array<std::string, 5>;
  for (const Keys& keys :
       {Keys{"heartbeatPeriod", "initialHeartbeatDelay", "nackSupressionDuration",
             "initialAcknackDelay", "heartbeatResponseDelay"},
        Keys{"heartbeat_period", "initial_heartbeat_delay", "nack_supression_duration",
             "initial_acknack_delay", "heartbeat_response_delay"}}) {
    std::string writer, reader;
    for (std::size_t i = 0; i < keys.size(); ++i)
      (i < 3 ? writer : reader) += "<" + keys[i] + "><sec>1</sec></" + keys[i] + ">";
    const fs::path file = make_file(
        "", "<data_writer profile_name='sls_loop_writer'><times>" + writer +
                "</times></data_writer><data_reader profile_name='sls_loop_reader'><times>" +
                reader + "</times></data_reader>");
    EXPECT_EXIT(use_file_and_exit(file), testing::ExitedWithCode(0), "");
  }
}

/// The first key exists in Fast DDS 2 only, the second in Fast DDS 3 only.
TEST_F(QosKeysDeathTest, AKeyThatOnlyTheOtherVersionHasIsNamedWithItsLine) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const fs::path file = make_file(
      "<throughputController><bytesPerPeriod>1</bytesPerPeriod></throughputController>\n"
      "<builtinTransports>UDPv4</builtinTransports>",
      "");
  EXPECT_EXIT(use_file_and_exit(file), testing::ExitedWithCode(2),
              "/qos\\.xml"  // in another folder: this test runs again for its exit
              ":(5: <throughputController>|6: <builtinTransports>): expected a key of Fast DDS " +
                  quote(middleware_version()) + ", got a misspelt one or one of another version");
}

// --- values that depend on the process -----------------------------------------------------------

/// Sets an environment variable for one test.
class Variable {
 public:
  Variable(const char* name, const char* value) : name_(name) { ::setenv(name, value, 1); }
  ~Variable() { ::unsetenv(name_); }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  const char* name_;
};

/// The texts of all elements of that name, in order.
std::vector<std::string> find_texts(const tinyxml2::XMLElement& element, const std::string& name) {
  std::vector<std::string> texts;
  if (element.Name() == name) texts.push_back(element.GetText() ? element.GetText() : "");
  for (auto* child = element.FirstChildElement(); child; child = child->NextSiblingElement())
    for (const std::string& text : find_texts(*child, name)) texts.push_back(text);
  return texts;
}

std::vector<std::string> find_texts(const std::string& xml, const std::string& name) {
  tinyxml2::XMLDocument document;
  EXPECT_EQ(document.Parse(xml.c_str()), tinyxml2::XML_SUCCESS) << xml;
  return find_texts(*document.RootElement(), name);
}

using Texts = std::vector<std::string>;

TEST_F(QosFileTest, PeersComeFromTheEnvironmentOneLocatorEach) {
  const fs::path file = kConfig / "qos/unicast.xml";
  EXPECT_EQ(find_texts(read_qos_file(file, "tester"), "address"), Texts({"127.0.0.1"}));
  const Variable peers("SLS_PEERS", "10.0.0.1, 10.0.0.2,localhost");
  EXPECT_EQ(find_texts(read_qos_file(file, "tester"), "address"),
            Texts({"10.0.0.1", "10.0.0.2", "127.0.0.1"}));
}

TEST_F(QosFileTest, AnInvalidHostIsNamedWithItsLine) {
  const Variable peers("SLS_PEERS", "10.0.0.1,no such host");
  const std::string error = find_error(kConfig / "qos/unicast.xml");
  EXPECT_NE(error.find("unicast.xml:3"), std::string::npos) << error;
  EXPECT_NE(error.find(": host 'no such host': expected a name or an IPv4 address, got: "),
            std::string::npos)
      << error;
}

TEST_F(QosFileTest, AVariableIsReplacedAndItsValueIsNotExpandedAgain) {
  const std::string begin = "<dds><profiles><participant profile_name=\"sls_participant\"><x>",
                    end = "</x></participant></profiles></dds>";
  const Variable variable("SLS_TEST", "a ${b} <c>");
  for (const auto& [text, expected] :
       std::map<std::string, std::string>{{"${SLS_TEST}", "a ${b} <c>"},
                                          {"1${SLS_TEST}2", "1a ${b} <c>2"},
                                          {"${SLS_NONE:-d}${SLS_NONE:-}", "d"},
                                          {"$SLS_TEST {} $", "$SLS_TEST {} $"},
                                          {"${SLS_IDENTITY}", "tester"},
                                          {"${SLS_IDENTITY:-nobody}", "tester"}}) {
    test::write_bytes(folder_ / "qos.xml", begin + text + end);
    EXPECT_EQ(find_texts(read_qos_file(folder_ / "qos.xml", "tester"), "x"), Texts({expected}));
  }
  const Variable identity("SLS_IDENTITY", "somebody");
  test::write_bytes(folder_ / "qos.xml", begin + "${SLS_IDENTITY}" + end);
  EXPECT_EQ(find_texts(read_qos_file(folder_ / "qos.xml", "tester"), "x"), Texts({"somebody"}));
}

TEST_F(QosFileTest, ListsOfHostsDoNotMultiply) {
  const auto write = [&](const std::string& locator) {
    test::write_bytes(folder_ / "qos.xml",
                      "<dds><profiles><participant profile_name=\"sls_participant\">" + locator +
                          "</participant></profiles></dds>");
  };
  const auto make_locator = [](const std::string& hosts, const std::string& inner) {
    return "<locator><udpv4><address>" + hosts + "</address></udpv4><x>" + inner + "</x></locator>";
  };
  write(make_locator("10.0.0.1,10.0.0.2", make_locator("10.0.0.3,10.0.0.4", "")));
  EXPECT_NE(find_error(folder_ / "qos.xml").find("expected none within another <locator>"),
            std::string::npos);
  std::string hosts;
  for (int i = 0; i < 100000; ++i) hosts += "10.0.0.1,";
  write(make_locator(hosts, ""));
  EXPECT_NE(find_error(folder_ / "qos.xml").find("expected at most 256 hosts, got 100000"),
            std::string::npos);
}

// --- a file sets the transport, not the behaviour of endpoints -----------------------------------

/// Name of each profile of `xml`, except the participant's → its content without comments.
std::map<std::string, std::string> read_endpoint_profiles(const std::string& xml) {
  tinyxml2::XMLDocument document;
  EXPECT_EQ(document.Parse(xml.c_str()), tinyxml2::XML_SUCCESS) << xml;
  std::map<std::string, std::string> profiles;
  const auto* list = document.RootElement()->FirstChildElement("profiles");
  for (auto* element = list->FirstChildElement(); element;
       element = element->NextSiblingElement()) {
    const char* name = element->Attribute("profile_name");
    if (!name || std::string(element->Name()) == "participant") continue;
    tinyxml2::XMLPrinter printer(nullptr, true);
    element->Accept(&printer);
    std::string text = printer.CStr();
    for (auto begin = text.find("<!--"); begin != std::string::npos; begin = text.find("<!--"))
      text.erase(begin, text.find("-->", begin) + 3 - begin);
    profiles[name] = text;
  }
  return profiles;
}

/// The text of endpoints.xml with the names that Fast DDS 3 gave its elements, if it is in use.
std::string name_elements(std::string text) {
  if (kFastDdsMajor == 2) return text;
  for (const auto& [from, to] : {std::pair{"heartbeatPeriod", "heartbeat_period"},
                                 std::pair{"heartbeatResponseDelay", "heartbeat_response_delay"},
                                 std::pair{"nackResponseDelay", "nack_response_delay"},
                                 std::pair{"nackSupressionDuration", "nack_supression_duration"}})
    for (auto at = text.find(from); at != text.npos; at = text.find(from, at))
      text.replace(at, std::string(from).size(), to);
  return text;
}

TEST(ShippedQosFilesTest, AFileWithoutWritersAndReadersUsesTheEndpointDefaults) {
  ::setenv("SLS_KEYS", "keys", 1);  // secure.xml needs it
  const auto shared =
      read_endpoint_profiles(name_elements(sls::test::read_bytes(kConfig / "qos/endpoints.xml")));
  EXPECT_EQ(shared.size(), 8u);
  for (const char* name : {"default", "udp", "lan", "unicast", "discovery_server", "secure"})
    EXPECT_EQ(read_endpoint_profiles(
                  read_qos_file(kConfig / "qos" / (std::string(name) + ".xml"), "tester")),
              shared)
        << name;
}

TEST_F(QosFileTest, AProfileOfItsOwnIsKept) {
  const std::string own =
      "<data_reader profile_name=\"sls_loop_reader\"><qos><reliability><kind>RELIABLE</kind>"
      "</reliability></qos></data_reader>";
  test::write_bytes(
      folder_ / "qos.xml",
      "<dds><profiles><participant profile_name=\"sls_participant\"/>" + own + "</profiles></dds>");
  const auto profiles = read_endpoint_profiles(read_qos_file(folder_ / "qos.xml", "tester"));
  EXPECT_EQ(profiles.size(), 8u);
  EXPECT_EQ(profiles.at("sls_loop_reader"), own);
}

TEST(ShippedQosFilesTest, UdpUsesNoSharedMemory) {
  const std::string text = sls::test::read_bytes(kConfig / "qos/udp.xml");
  EXPECT_EQ(text.find("<type>SHM"), std::string::npos);
  EXPECT_NE(text.find("<useBuiltinTransports>false"), std::string::npos);
}

}  // namespace
}  // namespace sls::bus
