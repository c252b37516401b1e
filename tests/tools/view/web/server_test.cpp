/// HTTP: resources, refusals, addresses.
#include "tools/view/web/server.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "common/config/config_error.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/waiting.hpp"
#include "tests/tools/view/web/running_server.hpp"
#include "tests/tools/view/web/sessions.hpp"
#include "tests/tools/view/web/web_client.hpp"

namespace sls::view {
namespace {

using test::RawClient;
using test::RunningServer;

class ServerTest : public testing::Test {
 protected:
  /// Header and body of the answer to these bytes.
  std::pair<std::string, std::string> ask(const std::string& request) {
    RawClient client(server_.port());
    client.send(request);
    return client.read_answer();
  }
  std::string get(const std::string& target, const std::string& fields = "") {
    return test::make_get(target, server_.port(), fields);
  }
  /// The status of the answer to these bytes. Expects that its body is one line of plain text.
  int find_status(const std::string& request) {
    const auto [header, body] = ask(request);
    if (header.size() < 12) return 0;
    EXPECT_NE(header.find("Content-Type: text/plain; charset=utf-8\r\n"), std::string::npos)
        << header;
    EXPECT_EQ(body.find('\n'), body.size() - 1) << body;
    return std::stoi(header.substr(9, 3));
  }
  RunningServer server_{test::make_options(), test::add_echo_and_page};
};

// --- resources -----------------------------------------------------------------------------------

TEST_F(ServerTest, ServesAResourceWithItsFields) {
  const auto [header, body] = ask(get("/?token=x&y"));
  EXPECT_EQ(header.rfind("HTTP/1.1 200 OK\r\n", 0), 0u) << header;
  for (const char* field : {"Content-Type: text/html; charset=utf-8", "Vary: Accept-Encoding",
                            "Content-Length: 8", "Cache-Control: no-store",
                            "X-Content-Type-Options: nosniff", "Referrer-Policy: no-referrer",
                            "X-Frame-Options: DENY", "Content-Security-Policy: default-src 'none'"})
    EXPECT_NE(header.find(std::string(field) + "\r\n"), std::string::npos) << field;
  EXPECT_EQ(body, "the page");
}

TEST_F(ServerTest, SendsGzipOnlyToClientsThatTakeIt) {
  for (const auto& [offer, is_gzip] :
       {std::pair("gzip", true), std::pair("br, GZip;q=0.5", true), std::pair("deflate", false),
        std::pair("gzip;q=0", false), std::pair("gzip; q=0.000, br", false), std::pair("", false),
        std::pair("notgzip", false), std::pair(";;,gzip", false)}) {
    const auto [header, body] = ask(get("/", "Accept-Encoding: " + std::string(offer) + "\r\n"));
    EXPECT_EQ(body, is_gzip ? "zipped" : "the page") << offer;
    EXPECT_EQ(header.find("Content-Encoding: gzip\r\n") != header.npos, is_gzip) << offer;
  }
}

TEST_F(ServerTest, ServesALargeResourceWhole) {
  const auto [header, body] = ask(get("/recording/0"));
  EXPECT_EQ(body, std::string(3'000'000, 'r'));
  EXPECT_EQ(header.find("Content-Encoding"), std::string::npos);
  EXPECT_EQ(header.find("Content-Security-Policy"), std::string::npos);
}

TEST_F(ServerTest, AnswersHeadWithoutABody) {
  RawClient client(server_.port());
  client.send("HEAD /recording/0 HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
  const std::string header = client.read_until("\r\n\r\n");
  EXPECT_NE(header.find("Content-Length: 3000000\r\n"), std::string::npos) << header;
  EXPECT_EQ(client.read_all(), "");
}

TEST_F(ServerTest, KeepsTheConnectionForFurtherRequests) {
  RawClient client(server_.port());
  for (int i = 0; i < 3; ++i) {
    client.send(get("/"));
    EXPECT_EQ(client.read_answer().second, "the page");
    client.send(get("/none"));
    EXPECT_EQ(client.read_answer().first.rfind("HTTP/1.1 404", 0), 0u);
  }
  client.send(get("/") + get("/"));  // pipelined
  EXPECT_EQ(client.read_answer().second, "the page");
  EXPECT_EQ(client.read_answer().second, "the page");
}

TEST_F(ServerTest, ClosesAfterTheAnswerWhereTheClientWantsIt) {
  for (const std::string& request : {get("/", "Connection: close\r\n"),
                                     std::string("GET / HTTP/1.0\r\nHost: localhost\r\n\r\n")}) {
    RawClient client(server_.port());
    client.send(request);
    EXPECT_EQ(client.read_answer().second, "the page");
    ::shutdown(client.socket(), SHUT_WR);
    EXPECT_TRUE(client.ends());
  }
}

// --- refusals ------------------------------------------------------------------------------------

TEST_F(ServerTest, FindsOnlyRegisteredPaths) {
  for (const char* target : {"/none",
                             "//",
                             "/.",
                             "/../etc/passwd",
                             "/../../../../../../etc/passwd",
                             "/%2e%2e/etc/passwd",
                             "/..%2f..%2fetc%2fpasswd",
                             "/%2e%2e%2f%2e%2e%2fetc%2fpasswd",
                             "/recording/../../etc/passwd",
                             "/..\\..\\etc\\passwd",
                             "/%c0%ae%c0%ae/etc/passwd",
                             "/recording/0/",
                             "/recording//0",
                             "/recording/%30",
                             "/recording",
                             "/;/",
                             "/#",
                             "/index.html",
                             "/%00",
                             "/recording/0%00.html"})
    EXPECT_EQ(find_status(get(target)), 404) << target;
}

TEST_F(ServerTest, RefusesTargetsThatAreNoPath) {
  for (const char* target : {"http://127.0.0.1/", "*", "etc/passwd", "/?token=%zz"})
    EXPECT_EQ(find_status(get(target)), 400) << target;
  EXPECT_EQ(find_status("CONNECT 127.0.0.1:80 HTTP/1.1\r\nHost: localhost\r\n\r\n"), 400);
}

TEST_F(ServerTest, RefusesOtherMethods) {
  for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "TRACE", "PATCH", "BREW"}) {
    const auto [header, body] = ask(std::string(method) + " / HTTP/1.1\r\nHost: localhost\r\n\r\n");
    EXPECT_EQ(header.rfind("HTTP/1.1 405", 0), 0u) << header;
    EXPECT_NE(header.find("Allow: GET, HEAD\r\n"), std::string::npos);
    EXPECT_EQ(body, "expected GET or HEAD\n");
  }
}

TEST_F(ServerTest, RefusesBodies) {
  EXPECT_EQ(find_status(get("/", "Content-Length: 5\r\n") + "hello"), 413);
  EXPECT_EQ(find_status(get("/", "Transfer-Encoding: chunked\r\n") + "5\r\nhello\r\n0\r\n\r\n"),
            413);
  EXPECT_EQ(find_status(get("/", "Content-Length: 18446744073709551615\r\n")), 413);
  EXPECT_EQ(find_status("POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1\r\n\r\nx"), 413);
  EXPECT_EQ(ask(get("/", "Content-Length: 0\r\n")).second, "the page");
}

TEST_F(ServerTest, RefusesLongHeaders) {
  EXPECT_EQ(find_status(get("/", "X: " + std::string(9'000, 'x') + "\r\n")), 431);
  EXPECT_EQ(find_status(get("/" + std::string(9'000, 'x'))), 431);
  std::string fields;
  for (int i = 0; i < 2'000; ++i) fields += "X: x\r\n";
  EXPECT_EQ(find_status(get("/", fields)), 431);
  EXPECT_EQ(find_status("GET / HTTP/1.1\r\nHost: localhost\r\nX: " + std::string(200'000, 'x')),
            431);
}

TEST_F(ServerTest, RefusesBytesThatAreNoRequest) {
  for (const std::string& bytes :
       {std::string("hello\r\n\r\n"), std::string("GET /\r\n\r\n"), std::string("\x16\x03\x01\x02"),
        std::string("GET / HTTP/3.0\r\nHost: localhost\r\n\r\n"),
        std::string("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"),
        std::string("GET / HTTP/1.1\r\nHost localhost\r\n\r\n"),
        std::string("GET / HTTP/1.1\r\nHost: local\0host\r\n\r\n", 36),
        get("/", "Content-Length: x\r\n"), get("/", "Content-Length: -1\r\n"),
        get("/", "Content-Length: 1\r\nContent-Length: 2\r\n"), get("/", "Host: evil.com\r\n"),
        get("/", "Origin: http://localhost\r\nOrigin: http://evil.com\r\n")})
    EXPECT_EQ(find_status(bytes), 400) << bytes;
}

TEST_F(ServerTest, RefusesForeignHostsAndOrigins) {
  EXPECT_EQ(find_status("GET / HTTP/1.1\r\nHost: localhost.evil.com\r\n\r\n"), 403);
  EXPECT_EQ(find_status("GET / HTTP/1.1\r\n\r\n"), 403);
  EXPECT_EQ(find_status(get("/", "Origin: null\r\n")), 403);
  EXPECT_EQ(find_status(get("/none", "Origin: http://evil.com\r\n")), 403);
  EXPECT_EQ(ask(get("/", "Origin: http://evil.com\r\n")).second,
            "expected a page of 127.0.0.1:" + std::to_string(server_.port()) +
                " or of --allow-origin, got Origin 'http://evil.com'\n");
}

// --- limits --------------------------------------------------------------------------------------

ServerOptions make_impatient_options() {
  ServerOptions options = test::make_options();
  options.limits.request_timeout_s = 0.3;
  return options;
}

TEST(ServerLimitsTest, EndsARequestThatComesByteByByte) {
  RunningServer server(make_impatient_options(), test::add_echo_and_page);
  RawClient client(server.port());
  client.send("GET / HTTP/1.1\r\nX: ");
  EXPECT_TRUE(test::wait_until([&] { return !client.send("x"); })) << "the server never closed it";
}

TEST(ServerLimitsTest, EndsConnectionsThatSendNothing) {
  RunningServer server(make_impatient_options(), test::add_echo_and_page);
  RawClient fresh(server.port());
  EXPECT_TRUE(fresh.ends());
  RawClient used(server.port());
  used.send(test::make_get("/", server.port()));
  EXPECT_EQ(used.read_answer().second, "the page");
  EXPECT_TRUE(used.ends());
}

TEST(ServerLimitsTest, EndsConnectionsThatDoNotReadTheirAnswer) {
  RunningServer server(make_impatient_options(), [](Server& prepared) {
    // The answers exceed the buffers of both ends; each is small enough for a short deadline.
    prepared.add_resource(
        "/large", {"text/plain", test::make_payload(std::string(100'000, 'x')), nullptr, ""});
  });
  RawClient stalled(server.port());
  const int small = 4'096;
  ::setsockopt(stalled.socket(), SOL_SOCKET, SO_RCVBUF, &small, sizeof(small));
  std::string requests;
  for (int i = 0; i < 200; ++i) requests += test::make_get("/large", server.port());
  stalled.send(requests);
  EXPECT_TRUE(test::wait_until([&] { return !stalled.send("x"); }));
}

TEST(ServerLimitsTest, AConnectionBeyondTheLimitReplacesTheOldestThatMayOnlyLook) {
  for (const bool is_of_one_address : {true, false}) {
    ServerOptions options = test::make_options();
    options.access.token = "0123456789abcdef";
    (is_of_one_address ? options.limits.connections_per_address : options.limits.connections) = 2;
    RunningServer server(options, test::add_echo_and_page);
    RawClient operating = test::open_websocket(server.port(), "other", "/?token=0123456789abcdef");
    std::vector<RawClient> idle;
    for (int i = 0; i < 20; ++i) idle.emplace_back(server.port());
    EXPECT_TRUE(idle[0].ends());
    RawClient next = test::open_websocket(server.port(), "other", "/?token=0123456789abcdef");
    for (RawClient* client : {&operating, &next}) {
      client->send(test::to_bytes({test::kText, "may"}));
      EXPECT_EQ(client->read_frame().payload, "yes");
    }
  }
}

// --- addresses -----------------------------------------------------------------------------------

std::string find_problem(const ServerOptions& options) {
  return test::find_error<config::ConfigError>([&] { Server server(options); });
}

TEST(ServerAddressTest, SaysThatThePortIsTakenAndWhatToDo) {
  Server first(test::make_options());
  ServerOptions options = test::make_options();
  options.port = first.port();
  EXPECT_EQ(find_problem(options), "--port: expected a free port, got " +
                                       std::to_string(first.port()) +
                                       ": Address already in use; choose another with --port N, or "
                                       "--port 0");
}

TEST(ServerAddressTest, SaysThatTheAddressIsNotOfThisMachine) {
  ServerOptions options = test::make_options();
  options.access.token = "0123456789abcdef";
  options.address = "192.0.2.1";  // reserved for documentation: RFC 5737
  EXPECT_EQ(find_problem(options),
            "--listen: expected an address of this machine, got 192.0.2.1: Cannot assign requested "
            "address");
  for (const char* address : {"myhost", "", "127.0.0.1:8765", "1.2.3"}) {
    options.address = address;
    EXPECT_EQ(find_problem(options), "--listen: expected an IP address of this machine, got '" +
                                         std::string(address) + "'");
  }
}

TEST(ServerAddressTest, RefusesAnotherAddressWithoutAToken) {
  ServerOptions options = test::make_options();
  options.address = "0.0.0.0";
  EXPECT_EQ(find_problem(options),
            "--listen: expected a loopback address, or --token-file with it, got 0.0.0.0");
}

TEST(ServerAddressTest, NamesItsUrl) {
  Server server(test::make_options());
  EXPECT_EQ(server.url(), "http://127.0.0.1:" + std::to_string(server.port()) + "/");
  ServerOptions options = test::make_options();
  options.address = "localhost";
  Server by_name(options);
  EXPECT_EQ(by_name.url(), "http://127.0.0.1:" + std::to_string(by_name.port()) + "/");
}

TEST(ServerAddressTest, ListensOnIpv6) {
  std::ifstream addresses("/proc/net/if_inet6");
  if (std::string address; !(addresses >> address)) GTEST_SKIP() << "this machine has no IPv6";
  ServerOptions options = test::make_options();
  options.address = "::1";
  Server server(options);
  EXPECT_EQ(server.url(), "http://[::1]:" + std::to_string(server.port()) + "/");
}

TEST(ServerAddressTest, TakesThePortAgainAtOnceAfterItsEnd) {
  ServerOptions options = test::make_options();
  {
    RunningServer server(options, test::add_echo_and_page);
    options.port = server.port();
    RawClient client = test::open_websocket(server.port(), "other");
    server.stop();
  }
  RunningServer again(options, test::add_echo_and_page);
  EXPECT_EQ(again.port(), options.port);
}

// --- tasks ---------------------------------------------------------------------------------------

TEST(ServerTaskTest, RepeatsATaskAtItsPeriod) {
  RunningServer server(test::make_options());
  int count = 0;
  const auto begin = std::chrono::steady_clock::now();
  server->repeat(0.01, [&count] { ++count; });
  EXPECT_TRUE(test::wait_until([&] { return server.ask([&] { return count >= 20; }); }));
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(199));
}

TEST(ServerTaskTest, ATaskThatThrowsEndsRunAndItsSessions) {
  Server server(test::make_options());
  test::Listed::List connections;
  server.add_protocol(test::make_listed(connections));
  std::string problem;
  std::thread thread([&] {
    try {
      server.run();
    } catch (const std::runtime_error& error) {
      problem = error.what();
    }
  });
  RawClient client = test::open_websocket(server.port(), "listed");
  server.post([] { throw std::runtime_error("as asked"); });
  thread.join();
  EXPECT_EQ(problem, "as asked");
  EXPECT_TRUE(connections.empty());
  EXPECT_EQ(server.count_connections(), 0u);
}

TEST(ServerTaskTest, StopsBeforeItRuns) {
  Server server(test::make_options());
  server.stop();
  server.run();
}

}  // namespace
}  // namespace sls::view
