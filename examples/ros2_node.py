"""A ROS 2 node: images in, vision_msgs/Detection2DArray out. For Humble and newer.

    python3 ros2_node.py --ros-args -r image:=/camera/image_raw -p speed:=1.0

Topics: `image` (sensor_msgs/Image; mono8, mono16, rgb8, bgr8, rgba8, bgra8) and `targets`, with the stamp and frame of the
image. Each detection is a box around a point: its id is the number of the trace, its score as in apgstmd.
Parameters: `speed`, px/frame (0: a bank of detectors for all speeds), `bit_depth` of mono16 (0: all 16 bits), `threads`
(0: all cores), `box_size`, px.
"""

import sys

import apgstmd
import numpy as np

CHANNELS = {"mono8": 1, "8UC1": 1, "mono16": 1, "16UC1": 1, "rgb8": 3, "bgr8": 3, "rgba8": 4, "bgra8": 4}


def to_array(message):
    """The picture of a sensor_msgs/Image, (height, width) or (height, width, 3), without copying where it can be."""
    if message.encoding not in CHANNELS:
        raise ValueError(f"the encoding is {message.encoding!r}, but it must be one of {', '.join(CHANNELS)}")
    channels = CHANNELS[message.encoding]
    kind = np.dtype(np.uint8)
    if message.encoding in ("mono16", "16UC1"):
        kind = np.dtype(">u2" if message.is_bigendian else "<u2")
    # Rows may be padded: step is their length in bytes.
    rows = np.frombuffer(message.data, np.uint8).reshape(message.height, message.step)
    samples = rows[:, : message.width * channels * kind.itemsize]
    if kind.itemsize == 2:
        return np.ascontiguousarray(samples).view(kind).astype(np.uint16, copy=False)
    if channels == 1:
        return samples
    picture = samples.reshape(message.height, message.width, channels)
    return picture[:, :, 2::-1] if message.encoding.startswith("bgr") else picture[:, :, :3]


def boxes(found, side):
    """What a Detection2D needs: id, score, centre x and y, side; px, the centre of the first pixel at 0, 0."""
    return [(str(target.trace), float(target.score), float(target.x), float(target.y), float(side)) for target in found]


def main():
    import rclpy
    from rclpy.node import Node
    from rclpy.qos import qos_profile_sensor_data
    from sensor_msgs.msg import Image
    from vision_msgs.msg import Detection2D, Detection2DArray, ObjectHypothesisWithPose

    class Targets(Node):
        def __init__(self):
            super().__init__("apgstmd")
            defaults = {"speed": 0.0, "bit_depth": 0, "threads": 0, "box_size": 5.0}
            self.told = {name: self.declare_parameter(name, value).value for name, value in defaults.items()}
            self.detector = None
            self.publisher = self.create_publisher(Detection2DArray, "targets", 10)
            # Sensor data: a frame that comes too late is left out, so that what is published is new.
            self.create_subscription(Image, "image", self.frame, qos_profile_sensor_data)

        def frame(self, message):
            picture = to_array(message)
            size = picture.shape[:2]
            if self.detector is None or self.detector.shape != size:
                options = {name: self.told[name] or None for name in ("threads", "bit_depth")}
                speed = self.told["speed"]
                made = apgstmd.Detector(size, speed=speed, **options) if speed else apgstmd.Bank(size, **options)
                self.detector = made
            out = self.detector.process(picture)
            found = Detection2DArray(header=message.header)
            for number, score, x, y, side in boxes(out.detections, self.told["box_size"]):
                box = Detection2D(header=message.header, id=number)
                box.bbox.center.position.x, box.bbox.center.position.y = x, y
                box.bbox.size_x = box.bbox.size_y = side
                kind = ObjectHypothesisWithPose()
                kind.hypothesis.class_id, kind.hypothesis.score = "target", score
                box.results.append(kind)
                found.detections.append(box)
            self.publisher.publish(found)

    rclpy.init(args=sys.argv)
    node = Targets()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
