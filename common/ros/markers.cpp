#include "common/ros/markers.hpp"

#include "common/ros/frames.hpp"

namespace sls::ros {
namespace {

/// visualization_msgs/Marker.type.
enum class Shape : std::int32_t { kCube = 1, kSphere = 2, kLineStrip = 4, kTriangles = 11 };

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
// Of a load on cables.
const Style kOutline = {5, Shape::kLineStrip, {0.03, 0, 0}, kLoad.color};
const Style kPlate = {6, Shape::kTriangles, {1, 1, 1}, {0.55F, 0.24F, 0.01F, 1}};
const Style kGround = {7, Shape::kCube, {40, 40, 0.01}, {0.45F, 0.45F, 0.40F, 0.5F}};
constexpr double kBodyCentre = 0.06;  // diameter of the ball at the centre of a rigid load, m

struct Marker {
  Style style;
  Pose pose;
  std::vector<Eigen::Vector3d> points;
  bool is_deleted = false;
};

void write_marker(CdrWriter& cdr, std::int64_t time_ns, const std::string& name,
                  const Marker& marker) {
  const auto& [style, pose, points, is_deleted] = marker;
  write_header(cdr, time_ns, kWorld);
  cdr.write(name);
  cdr.write(style.id);
  cdr.write(static_cast<std::int32_t>(style.shape));
  cdr.write(std::int32_t{is_deleted ? 2 : 0});  // action: 0 adds
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

std::vector<Eigen::Vector3d> to_ros_points(std::vector<Eigen::Vector3d> points) {
  for (Eigen::Vector3d& point : points) point = to_ros(point);
  return points;
}

/// The cable of a vehicle at `quadrotor` that ends at `end`; deleted once it is cut.
Marker make_cable(const LoadOnCable& on_cable, const Eigen::Vector3d& quadrotor,
                  const Eigen::Vector3d& end) {
  const auto& [scene, cable] = on_cable;
  Style style = kRod;
  const scene::Colour colour = scene::calc_colour(scene, cable);
  style.color = {colour[0], colour[1], colour[2], 1};
  // The conversion is its own inverse.
  return {style,
          {},
          to_ros_points(scene::calc_cable_points(scene, cable, to_ros(quadrotor), to_ros(end))),
          cable.is_released};
}

/// Outline and plate of a rigid load, and the ground.
void add_load_markers(const LoadOnCable& on_cable, const Pose& load, std::vector<Marker>& markers) {
  std::vector<Eigen::Vector3d> outline = to_ros_points(on_cable.scene.outline_L);
  if (outline.size() > 1) {
    outline.push_back(outline.front());
    markers.push_back({kOutline, load, outline});
  }
  std::vector<Eigen::Vector3d> triangles;
  for (std::size_t i = 2; i + 1 < outline.size(); ++i)
    triangles.insert(triangles.end(), {outline[0], outline[i - 1], outline[i]});
  if (!triangles.empty()) markers.push_back({kPlate, load, triangles});
  if (const auto& z = on_cable.scene.ground_z_W) {
    const Eigen::Vector3d centre(0, 0, *z + 0.5 * kGround.scale.z());
    markers.push_back({kGround, {to_ros(centre), Eigen::Quaterniond::Identity()}, {}});
  }
}

}  // namespace

void Trail::add(const Eigen::Vector3d& point) {
  if (!points_.empty() && (point - points_.back()).norm() < kLeastStep) return;
  if (points_.size() == kMostPoints) points_.erase(points_.begin());
  points_.push_back(point);
}

VehicleMarkers::VehicleMarkers(std::uint32_t vehicle_id)
    : vehicle_id_(vehicle_id), name_(name_vehicle(vehicle_id)) {}

void VehicleMarkers::write(CdrWriter& cdr, std::int64_t sim_time_ns, const Pose& quadrotor,
                           const Eigen::Vector3d& load,
                           const std::optional<Eigen::Vector3d>& reference,
                           const std::optional<LoadOnCable>& on_cable) {
  next_ns_ = (sim_time_ns / kPeriodNs + 1) * kPeriodNs;
  std::vector<Marker> markers = {{kBody, quadrotor, {}}};
  Pose centre = {load, Eigen::Quaterniond::Identity()};  // of the load
  Style ball = kLoad;
  bool has_load = true;
  if (on_cable) {
    const auto& [scene, cable] = *on_cable;
    centre = {to_ros(to_ros(load) - cable.q_WL * scene.attachments_L.at(vehicle_id_)),
              to_ros(cable.q_WL)};
    if (!scene.outline_L.empty()) ball.scale.setConstant(kBodyCentre);
    has_load = vehicle_id_ == scene.attachments_L.begin()->first;
    markers.push_back(make_cable(*on_cable, quadrotor.position, load));
  } else {
    markers.push_back({kRod, {}, {quadrotor.position, load}});
  }
  if (has_load) {
    load_trail_.add(centre.position);
    markers.push_back({ball, centre, {}});
    markers.push_back({kLoadTrail, {}, extend(load_trail_, centre.position)});
  }
  if (reference) {
    reference_trail_.add(*reference);
    markers.push_back({kReferenceTrail, {}, extend(reference_trail_, *reference)});
  }
  if (has_load && on_cable) add_load_markers(*on_cable, centre, markers);
  cdr.begin();
  cdr.write(static_cast<std::uint32_t>(markers.size()));
  for (const Marker& marker : markers) write_marker(cdr, sim_time_ns, name_, marker);
}

}  // namespace sls::ros
