#include "common/ros/mirrors.hpp"

#include <algorithm>
#include <stdexcept>

#include "common/ros/cdr_writer.hpp"
#include "common/ros/frames.hpp"
#include "common/ros/markers.hpp"
#include "common/ros/parts.hpp"
#include "common/ros/schemas.hpp"

namespace sls::ros {
namespace {

/// Index into the channels: first those of the run, then those of each vehicle.
enum RunChannel : std::size_t { kClock, kTf, kTfStatic, kRunChannels };
enum VehicleChannel : std::size_t {
  kQuadrotorOdometry,
  kLoadOdometry,
  kQuadrotorPose,
  kLoadPose,
  kLoadReference,
  kMarkers,
  kVehicleChannels
};

Channel make_channel(const std::string& topic, const std::string& type, bool is_latched = false) {
  return {topic, type, make_schema(type), find_type_hash(type), is_latched};
}

std::vector<Channel> make_channels(const std::vector<std::uint32_t>& vehicle_ids) {
  const std::string odometry = "nav_msgs/msg/Odometry", pose = "geometry_msgs/msg/PoseStamped";
  std::vector<Channel> channels = {make_channel("/clock", "rosgraph_msgs/msg/Clock"),
                                   make_channel("/tf", "tf2_msgs/msg/TFMessage"),
                                   make_channel("/tf_static", "tf2_msgs/msg/TFMessage", true)};
  for (const std::uint32_t vehicle_id : vehicle_ids) {
    const std::string prefix = "/sls/" + name_vehicle(vehicle_id);
    channels.push_back(make_channel(prefix + "/quadrotor/odometry", odometry));
    channels.push_back(make_channel(prefix + "/load/odometry", odometry));
    channels.push_back(make_channel(prefix + "/quadrotor/pose", pose));
    channels.push_back(make_channel(prefix + "/load/pose", pose));
    channels.push_back(make_channel(prefix + "/load/reference", pose));
    channels.push_back(make_channel(prefix + "/markers", "visualization_msgs/msg/MarkerArray"));
  }
  return channels;
}

/// Linear and angular velocity in the frame of the body.
struct Twist {
  Eigen::Vector3d linear;
  Eigen::Vector3d angular;
};

/// nav_msgs/Odometry. Its covariances are zero: the numbers are those of the simulation.
void write_odometry(CdrWriter& cdr, std::int64_t time_ns, const std::string& child_frame,
                    const Pose& pose, const Twist& twist) {
  constexpr std::size_t kCovariance = 36;
  cdr.begin();
  write_header(cdr, time_ns, kWorld);
  cdr.write(child_frame);
  write_pose(cdr, pose);
  cdr.write_zeros(kCovariance);
  write_vector(cdr, twist.linear);
  write_vector(cdr, twist.angular);
  cdr.write_zeros(kCovariance);
}

/// geometry_msgs/PoseStamped in `world`.
void write_pose_stamped(CdrWriter& cdr, std::int64_t time_ns, const Pose& pose) {
  cdr.begin();
  write_header(cdr, time_ns, kWorld);
  write_pose(cdr, pose);
}

/// geometry_msgs/TransformStamped in `world`.
void write_transform(CdrWriter& cdr, std::int64_t time_ns, const std::string& child_frame,
                     const Pose& pose) {
  write_header(cdr, time_ns, kWorld);
  cdr.write(child_frame);
  write_pose(cdr, pose);
}

}  // namespace

struct Mirrors::Impl {
  struct Vehicle {
    std::uint32_t id;
    std::size_t first_channel;
    std::string quadrotor_frame;
    std::string load_frame;
    VehicleMarkers markers;
  };

  Impl(const std::vector<std::uint32_t>& vehicle_ids, std::optional<scene::LoadScene> load_scene)
      : channels(make_channels(vehicle_ids)), scene(std::move(load_scene)) {
    for (const std::uint32_t id : vehicle_ids)
      vehicles.push_back({id, kRunChannels + vehicles.size() * kVehicleChannels,
                          name_quadrotor_frame(id), name_load_frame(id), VehicleMarkers(id)});
  }

  Vehicle& find_vehicle(std::uint32_t id) {
    const auto found =
        std::lower_bound(vehicles.begin(), vehicles.end(), id,
                         [](const Vehicle& vehicle, std::uint32_t of) { return vehicle.id < of; });
    if (found == vehicles.end() || found->id != id)
      throw std::invalid_argument("mirrors: expected a vehicle of the run, got vehicle " +
                                  std::to_string(id));
    return *found;
  }

  void emit_clock(std::uint64_t step, std::int64_t time_ns, const Emit& emit) {
    if (last_clock_step && step <= *last_clock_step) return;
    last_clock_step = step;
    cdr.begin();
    write_time(cdr, time_ns);
    emit(kClock, time_ns, cdr.bytes());
  }

  void emit_transforms(const Vehicle& vehicle, std::int64_t time_ns, const Pose& quadrotor,
                       const Pose& load, const Emit& emit) {
    cdr.begin();
    cdr.write(std::uint32_t{2});
    write_transform(cdr, time_ns, vehicle.quadrotor_frame, quadrotor);
    write_transform(cdr, time_ns, vehicle.load_frame, load);
    emit(kTf, time_ns, cdr.bytes());
  }

  /// The cable of a vehicle of a run with a load on cables.
  std::optional<scene::Cable> find_cable(const VehicleSample& sample) const {
    if (!scene || scene->attachments_L.count(sample.vehicle_id) == 0) return std::nullopt;
    return scene::read_cable(*scene, sample.signals);
  }

  std::vector<Channel> channels;
  std::optional<scene::LoadScene> scene;
  std::vector<Vehicle> vehicles;
  std::optional<std::uint64_t> last_clock_step;
  CdrWriter cdr;
};

Mirrors::Mirrors(const std::vector<std::uint32_t>& vehicle_ids,
                 std::optional<scene::LoadScene> scene)
    : impl_(std::make_unique<Impl>(vehicle_ids, std::move(scene))) {}
Mirrors::~Mirrors() = default;

const std::vector<Channel>& Mirrors::channels() const { return impl_->channels; }

void Mirrors::emit_static(const Emit& emit) {
  CdrWriter& cdr = impl_->cdr;
  cdr.begin();
  cdr.write(std::uint32_t{1});
  write_transform(cdr, 0, kWorldZDown, {Eigen::Vector3d::Zero(), half_turn_about_x()});
  emit(kTfStatic, 0, cdr.bytes());
}

void Mirrors::emit(const VehicleSample& sample, const Emit& emit) {
  Impl::Vehicle& vehicle = impl_->find_vehicle(sample.vehicle_id);
  CdrWriter& cdr = impl_->cdr;
  const std::int64_t time_ns = sample.sim_time_ns;
  const Pose quadrotor = {to_ros(sample.p_WQ), to_ros(sample.q_WB)};
  const std::optional<scene::Cable> cable = impl_->find_cable(sample);
  const Eigen::Quaterniond q_WL = cable ? cable->q_WL : Eigen::Quaterniond::Identity();
  const Pose load = {to_ros(sample.p_WL), to_ros(q_WL)};
  const Twist quadrotor_twist = {to_ros(sample.q_WB.conjugate() * sample.v_WQ),
                                 to_ros(sample.w_WB_B)};
  const Twist load_twist = {to_ros(q_WL.conjugate() * sample.v_WL),
                            to_ros(cable ? cable->w_WL_L : Eigen::Vector3d::Zero())};
  const auto send = [&](VehicleChannel channel) {
    emit(vehicle.first_channel + channel, time_ns, cdr.bytes());
  };

  impl_->emit_clock(sample.step, time_ns, emit);
  impl_->emit_transforms(vehicle, time_ns, quadrotor, load, emit);
  write_odometry(cdr, time_ns, vehicle.quadrotor_frame, quadrotor, quadrotor_twist);
  send(kQuadrotorOdometry);
  write_odometry(cdr, time_ns, vehicle.load_frame, load, load_twist);
  send(kLoadOdometry);
  write_pose_stamped(cdr, time_ns, quadrotor);
  send(kQuadrotorPose);
  write_pose_stamped(cdr, time_ns, load);
  send(kLoadPose);
  std::optional<Eigen::Vector3d> reference;
  if (sample.reference) {
    reference = to_ros(*sample.reference);
    write_pose_stamped(cdr, time_ns, {*reference, Eigen::Quaterniond::Identity()});
    send(kLoadReference);
  }
  if (vehicle.markers.is_due(time_ns)) {
    const auto on_cable =
        cable ? std::optional<LoadOnCable>({*impl_->scene, *cable}) : std::nullopt;
    vehicle.markers.write(cdr, time_ns, quadrotor, load.position, reference, on_cable);
    send(kMarkers);
  }
}

}  // namespace sls::ros
