"""What people fold by: the steps in pictures, as a manual and as a page that plays."""
