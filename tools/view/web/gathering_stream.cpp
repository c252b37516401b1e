#include "tools/view/web/gathering_stream.hpp"

#include <boost/asio/error.hpp>
#include <boost/asio/write.hpp>

namespace sls::view {
namespace {

constexpr std::chrono::milliseconds kLeastInterval(1);

}  // namespace

void GatheringStream::State::flush_soon() {
  if (leaving_bytes != 0 || is_timer_set || gathered.empty()) return;
  const auto due = last_flush + kLeastInterval;
  if (std::chrono::steady_clock::now() >= due) {
    flush();
    return;
  }
  is_timer_set = true;
  flush_timer.expires_at(due);
  flush_timer.async_wait([state = shared_from_this()](Error) {
    state->is_timer_set = false;
    state->flush();
  });
}

void GatheringStream::State::flush() {
  if (leaving_bytes != 0 || gathered.empty() || error) return;
  leaving.swap(gathered);
  gathered.clear();
  leaving_bytes = leaving.size();
  last_flush = std::chrono::steady_clock::now();
  net::async_write(
      socket, net::buffer(leaving),
      [state = shared_from_this()](Error result, std::size_t) { state->note_flushed(result); });
}

void GatheringStream::State::note_flushed(Error result) {
  leaving_bytes = 0;
  if (result && !error) error = result;
  if (error) gathered.clear();
  if (writer.has_value() || drainer.has_value())
    flush();
  else
    flush_soon();
  // Both handlers may destroy this stream. `state` of the caller keeps the members used here alive.
  if (writer.has_value()) writer.invoke();
  if (leaving_bytes == 0 && gathered.empty() && drainer.has_value()) drainer.invoke();
}

/// Posts the handler, because it must not run within the call that started the operation.
void GatheringStream::State::invoke(beast::saved_handler& handler) {
  if (!handler.has_value()) return;
  net::post(socket.get_executor(),
            [state = shared_from_this(), saved = std::move(handler)]() mutable { saved.invoke(); });
}

void GatheringStream::State::close() {
  if (!error) error = net::error::operation_aborted;
  Error ignored;
  socket.close(ignored);
  flush_timer.cancel();
  gathered.clear();
  // Moves the handlers out: they hold the stream that holds this state, and each would keep the
  // other alive.
  invoke(writer);
  invoke(drainer);
}

}  // namespace sls::view
