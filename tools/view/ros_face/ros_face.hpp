/// `sls_view --ros`: the mirrors of common/ros on rt/… topics, over UDP. It only writes: no topic
/// or service of ROS affects a flight.
#pragma once

#include <memory>

#include "common/bus/node.hpp"
#include "tools/view/live/feed.hpp"

namespace sls::view {

class RosFace {
 public:
  RosFace(bus::Node& node, Feed& feed);
  ~RosFace();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sls::view
