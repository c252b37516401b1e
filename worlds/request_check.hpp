/// What an operator asks of a run, judged by the table in docs/synchronisation.md, "Operator
/// control": which requests are accepted, what is replied, and what is flown.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sls.h"

namespace sls::worlds {

class RequestCheck {
 public:
  /// Of run `run_id`. `find`: called with each broken rule.
  RequestCheck(std::uint64_t run_id, std::vector<std::uint32_t> vehicle_ids,
               std::function<void(std::string)> find)
      : run_id_(run_id), vehicle_ids_(std::move(vehicle_ids)), find_(std::move(find)) {}

  /// The run comes after this one, which was reset.
  void follow(const RequestCheck& before) { is_paused_ = before.is_paused_; }
  /// The server takes up `request`. `is_of_other`: it knows that another server flies that run.
  void on_request(const SimControl& request, bool is_of_other);
  void on_reply(const SimControlReply& reply);
  void on_published(std::uint64_t step);
  void on_recorded(std::uint64_t step);
  void on_end();

 private:
  struct Key {
    std::string operator_name;
    std::uint64_t request_id = 0;
    bool operator==(const Key& other) const {
      return request_id == other.request_id && operator_name == other.operator_name;
    }
  };
  struct Expected {
    Key key;
    bool is_accepted = false;
    std::string reason;      ///< its begin
    std::uint64_t step = 0;  ///< of the run
    std::uint64_t done = 0;  ///< steps of a request for steps; the end of the run may come first
  };
  struct StepRequest {
    Key key;
    std::uint64_t begin = 0, steps = 0;
    std::string paused_by;  ///< empty: nobody
  };

  std::string judge(const SimControl& request) const;
  void act(const SimControl& request, const Key& key);
  void expect(Expected reply);
  void expect_cut_short();
  void check(const SimControlReply& reply, const Expected& expected);
  bool is_cut_short(const SimControlReply& reply, const Key& key, std::uint64_t begin,
                    std::uint64_t done);

  const std::uint64_t run_id_;
  const std::vector<std::uint32_t> vehicle_ids_;
  const std::function<void(std::string)> find_;
  std::uint64_t step_ = 0;  // published next, or not yet flown
  bool is_paused_ = false;
  bool is_over_ = false;
  std::optional<StepRequest> stepping_;
  std::deque<Expected> answered_;  // the last 64, for requests that come again
  std::deque<Expected> replies_;   // in the order in which they must come
};

}  // namespace sls::worlds
