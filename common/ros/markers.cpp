#include "common/ros/markers.hpp"

#include "common/ros/frames.hpp"

namespace sls::ros {
namespace {

/// visualization_msgs/Marker.type.
enum class Shape : std::int32_t { kCube = 1, kSphere = 2, kLineStrip = 4 };

struct Color {
  float r, g, b, a;
};

/// Id of a marker within its vehicle, and its appearance.
struct Style {
  std::int32_t id;
  Shape shape;
  Eigen::Vector3d scale;  ///< m; of a line strip: its width first
  Color color;
};

const Style kBody = {0, Shape::kCube, {0.35, 0.35, 0.06}, {0.17F, 0.30F, 0.48F, 1}};
const Style kRod = {1, Shape::kLineStrip, {0.02, 0, 0}, {0.50F, 0.50F, 0.50F, 1}};
const Style kLoad = {2, Shape::kSphere, {0.15, 0.15, 0.15}, {0.85F, 0.37F, 0.01F, 1}};
const Style kLoadTrail = {3, Shape::kLineStrip, {0.02, 0, 0}, {0.85F, 0.37F, 0.01F, 0.8F}};
const Style kReferenceTrail = {4, Shape::kLineStrip, {0.01, 0, 0}, {0.10F, 0.62F, 0.47F, 0.8F}};

void write_marker(CdrWriter& cdr, std::int64_t time_ns, const std::string& name, const Style& style,
                  const Pose& pose, const std::vector<Eigen::Vector3d>& points) {
  write_header(cdr, time_ns, kWorld);
  cdr.write(name);
  cdr.write(style.id);
  cdr.write(static_cast<std::int32_t>(style.shape));
  cdr.write(std::int32_t{0});  // action: add
  write_pose(cdr, pose);
  write_vector(cdr, style.scale);
  for (const float part : {style.color.r, style.color.g, style.color.b, style.color.a})
    cdr.write(part);
  write_time(cdr, 0);  // lifetime: until it is replaced
  cdr.write(false);    // frame_locked
  cdr.write(static_cast<std::uint32_t>(points.size()));
  for (const Eigen::Vector3d& point : points) write_vector(cdr, point);
  cdr.write(std::uint32_t{0});    // colors
  cdr.write(std::string_view());  // texture_resource
  write_header(cdr, 0, "");       // texture
  cdr.write(std::string_view());  // texture.format
  cdr.write(std::uint32_t{0});    // texture.data
  cdr.write(std::uint32_t{0});    // uv_coordinates
  cdr.write(std::string_view());  // text
  cdr.write(std::string_view());  // mesh_resource
  cdr.write(std::string_view());  // mesh_file.filename
  cdr.write(std::uint32_t{0});    // mesh_file.data
  cdr.write(false);               // mesh_use_embedded_materials
}

/// The points of `trail` and then `end`, the current position: at least two, as a line requires.
std::vector<Eigen::Vector3d> extend(const Trail& trail, const Eigen::Vector3d& end) {
  std::vector<Eigen::Vector3d> points = trail.points();
  points.push_back(end);
  return points;
}

}  // namespace

void Trail::add(const Eigen::Vector3d& point) {
  if (!points_.empty() && (point - points_.back()).norm() < kLeastStep) return;
  if (points_.size() == kMostPoints) points_.erase(points_.begin());
  points_.push_back(point);
}

VehicleMarkers::VehicleMarkers(std::uint32_t vehicle_id) : name_(name_vehicle(vehicle_id)) {}

void VehicleMarkers::write(CdrWriter& cdr, std::int64_t sim_time_ns, const Pose& quadrotor,
                           const Eigen::Vector3d& load,
                           const std::optional<Eigen::Vector3d>& reference) {
  next_ns_ = (sim_time_ns / kPeriodNs + 1) * kPeriodNs;
  load_trail_.add(load);
  if (reference) reference_trail_.add(*reference);
  cdr.begin();
  cdr.write(std::uint32_t{reference ? 5U : 4U});
  write_marker(cdr, sim_time_ns, name_, kBody, quadrotor, {});
  write_marker(cdr, sim_time_ns, name_, kRod, {}, {quadrotor.position, load});
  write_marker(cdr, sim_time_ns, name_, kLoad, {load, Eigen::Quaterniond::Identity()}, {});
  write_marker(cdr, sim_time_ns, name_, kLoadTrail, {}, extend(load_trail_, load));
  if (reference)
    write_marker(cdr, sim_time_ns, name_, kReferenceTrail, {},
                 extend(reference_trail_, *reference));
}

}  // namespace sls::ros
