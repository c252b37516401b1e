/// The TCP socket under a WebSocket: gathers frames, so that one system call sends many.
#pragma once

#include <algorithm>
#include <boost/asio/async_result.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/post.hpp>
#include <boost/beast/core/bind_handler.hpp>
#include <boost/beast/core/saved_handler.hpp>
#include <boost/beast/websocket/teardown.hpp>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>

#include "tools/view/web/asio.hpp"

namespace sls::view {

/// An AsyncStream whose writes are complete once their bytes are copied. Bytes are sent at once if
/// nothing was sent in the last millisecond; otherwise after that millisecond, or once there are
/// kMostGathered of them. Writes wait while kMostGathered bytes are gathered and an earlier block
/// is still being written.
class GatheringStream {
 public:
  using executor_type = Executor;
  using next_layer_type = Socket;

  explicit GatheringStream(Socket socket) : state_(std::make_shared<State>(std::move(socket))) {}
  GatheringStream(GatheringStream&&) = default;
  ~GatheringStream() {
    if (state_) state_->close();
  }

  executor_type get_executor() noexcept { return state_->socket.get_executor(); }
  next_layer_type& next_layer() noexcept { return state_->socket; }
  const next_layer_type& next_layer() const noexcept { return state_->socket; }

  /// Bytes that the system has not accepted yet.
  std::size_t pending_bytes() const { return state_->gathered.size() + state_->leaving_bytes; }
  /// Closes the socket; waiting operations end with operation_aborted.
  void close() { state_->close(); }

  template <class Buffers, class Handler>
  auto async_read_some(const Buffers& buffers, Handler&& handler) {
    return state_->socket.async_read_some(buffers, std::forward<Handler>(handler));
  }

  template <class Buffers, class Handler>
  auto async_write_some(const Buffers& buffers, Handler&& handler) {
    return net::async_initiate<Handler, void(Error, std::size_t)>(
        [state = state_](auto completion, const Buffers& bytes) {
          state->write(bytes, std::move(completion));
        },
        handler, buffers);
  }

  /// Customisation point of Beast: shuts the connection down, here after all bytes are sent.
  template <class Handler>
  friend void async_teardown(beast::role_type role, GatheringStream& stream, Handler&& handler) {
    const std::shared_ptr<State> state = stream.state_;
    state->drain([state, role, completion = std::forward<Handler>(handler)](Error = {}) mutable {
      beast::websocket::async_teardown(role, state->socket, std::move(completion));
    });
  }

 private:
  static constexpr std::size_t kMostGathered = 32 * 1024;

  /// Lives as long as the stream and every operation on the socket.
  struct State : std::enable_shared_from_this<State> {
    explicit State(Socket opened) : socket(std::move(opened)), flush_timer(socket.get_executor()) {}

    template <class Buffers, class Handler>
    void write(const Buffers& buffers, Handler handler);
    template <class Handler>
    void drain(Handler handler);
    void flush_soon();
    void flush();
    void note_flushed(Error result);
    void invoke(beast::saved_handler& handler);
    void close();

    Socket socket;
    Timer flush_timer;
    std::string gathered;
    std::string leaving;  ///< being written to the socket
    std::size_t leaving_bytes = 0;
    std::chrono::steady_clock::time_point last_flush;
    bool is_timer_set = false;
    Error error;
    // Newer versions of Beast also call a handler with the error of a cancelled operation. Nothing
    // cancels these.
    beast::saved_handler writer;   ///< waits for room
    beast::saved_handler drainer;  ///< waits until all bytes are sent
  };

  std::shared_ptr<State> state_;
};

template <class Buffers, class Handler>
void GatheringStream::State::write(const Buffers& buffers, Handler handler) {
  if (error) {
    net::post(socket.get_executor(),
              beast::bind_front_handler(std::move(handler), error, std::size_t{0}));
    return;
  }
  const std::size_t before = gathered.size();  // below kMostGathered: otherwise a writer waits
  const std::size_t count = std::min(net::buffer_size(buffers), kMostGathered - before);
  gathered.resize(before + count);
  net::buffer_copy(net::buffer(gathered.data() + before, count), buffers);
  if (gathered.size() == kMostGathered)
    flush();
  else
    flush_soon();
  if (gathered.size() < kMostGathered)
    net::post(socket.get_executor(), beast::bind_front_handler(std::move(handler), error, count));
  else
    writer.emplace([this, count, completion = std::move(handler)](Error = {}) mutable {
      completion(error, error ? 0 : count);
    });
}

template <class Handler>
void GatheringStream::State::drain(Handler handler) {
  drainer.emplace(std::move(handler));
  flush();
  if (leaving_bytes == 0) invoke(drainer);
}

}  // namespace sls::view
