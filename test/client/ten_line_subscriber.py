# SPDX-License-Identifier: Apache-2.0
import rclpy
from hpccd.msg import ContactArray

from hpccd_ros import client


def on_contacts(message):
    contacts = client.contacts_from_message(message)
    print(f"step {message.step}: {message.total} contacts, the first at {message.first_toc}", contacts.toc[:3])


client.prepare_environment()
rclpy.init()
node = rclpy.create_node("listener")
node.create_subscription(ContactArray, client.CONTACTS_TOPIC, on_contacts, client.CONTACTS_QOS)
rclpy.spin(node)
