#pragma once

#include <cstdint>

#include "common/base/result.h"
#include "common/job/job_spec.h"
#include "common/math/vec3.h"

namespace baton {

/// Where camera and objects are at a frame: pure functions of the job.

/// Whether camera or objects have keys, or meshes of objects deform.
bool moves(const JobSpec& job);
/// Whether the object has keys.
bool moves(const ObjectSpec& object);

/// Whether all that moves has keys of its own, none in another file, and motion.max_px is known:
/// what common/scene/settle/settle_motion.h makes of a job before it is submitted.
bool is_settled(const JobSpec& job);
/// An error that says what is missing unless is_settled().
Status check_settled(const JobSpec& job);

/// Whether pixels take history from other pixels: camera or objects move, or neighbours are asked.
/// A tile then needs the states of those near it, frame by frame.
bool shares_history(const JobSpec& job);
/// How far away in the image, per frame and in either direction, a pixel may take its history from:
/// motion.max_px, where something moves, and sampling.neighbor_radius, where neighbours are asked;
/// 0 when each pixel keeps to itself.
std::int32_t history_reach_px(const JobSpec& job);

Transform to_transform(const Matrix34& matrix);

/// The camera at a frame number, without keys. Position, point looked at, up and angle of view
/// follow motion.curve.
CameraSpec camera_at(const JobSpec& job, double frame);

/// What the keys do to the placed object at a frame number; the identity without keys. Translation,
/// angles and scale follow `curve`, the quaternion is slerped [Shoemake 1985] the short way round.
/// The map is about the origin of the placed object: world = object.translate + map(placed -
/// object.translate). It is singular where the object is not there: at a scale of 0.
Transform object_motion_at(const ObjectSpec& object, KeyCurve curve, double frame);

}  // namespace baton
